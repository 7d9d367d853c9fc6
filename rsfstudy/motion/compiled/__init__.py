"""Motions compiled by Numba: the same equations, the same events, much faster."""
