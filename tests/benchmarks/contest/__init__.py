"""Who takes part in the benchmark ``tests/benchmarks/peers.py``, and in what."""
