"""Integration of a scene: accuracy, work budget, steps, regimes, events; three engines."""
