"""Participants and problems of the benchmark ``engine_benchmark.py``."""
