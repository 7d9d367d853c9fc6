"""Declaration of studies: labelled axes over a scene, a measure, reductions, published values."""
