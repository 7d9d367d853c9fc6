"""Who takes part in the benchmark ``tests/benchmarks/engine_benchmark.py``, and in what."""
