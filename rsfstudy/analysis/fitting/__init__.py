"""Friction parameters from records of a laboratory, with errors that count correlated noise."""
