"""Reductions of the results of a study."""
