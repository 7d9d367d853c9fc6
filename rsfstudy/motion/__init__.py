"""Integration of a scene with SciPy: accuracy, work budget, steps, and the regimes of motion."""
