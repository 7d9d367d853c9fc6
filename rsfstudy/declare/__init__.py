"""What a study is: labelled axes over a scene, a measure, reductions, and published values."""
