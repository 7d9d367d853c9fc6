"""Compilation of the event loop and the equations with Numba.

``numba_backend`` is the entry point. It compiles the event loop once, and the equations once for
each combination of scene parts (friction law, loading, fluid and so on). ``compile_cache`` stores
the compiled functions on disk, ``array_operations`` contains functions that replace Python
functions in compiled code, and ``compilation_errors`` creates error messages.
"""
