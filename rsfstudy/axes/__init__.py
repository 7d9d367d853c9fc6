"""Axes of a lattice: listed values, labelled points, samples that are drawn, rows of tables."""
