"""Declaration of studies, which runs nothing: axes over a scene, a measure, reductions, claims."""
