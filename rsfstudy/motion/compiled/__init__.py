"""Compilation of the event loop and the equations with Numba.

``numba_backend`` is the entry point. It compiles the loop once and the equations once for each
combination of parts. ``compile_cache`` stores the results on disk, ``array_operations`` contains
functions that replace Python functions in compiled code, and ``compilation_errors`` creates error
messages.
"""
