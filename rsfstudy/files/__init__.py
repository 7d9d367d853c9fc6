"""Finished cells and results files: written, checked and read back."""
