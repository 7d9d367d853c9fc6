"""Who takes part in the benchmark ``tests/peers.py``, and in what."""
