"""Integration of a scene: accuracy, work budget, steps, regimes of motion, events; two engines."""
