"""Algorithms that measures use: critical steps, the paths that touch the boundary, and cycles."""
