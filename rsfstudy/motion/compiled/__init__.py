"""Functions that compile the event loop and the equations of motion with Numba.

The module ``numba_backend`` is the entry point. This module compiles the event loop once, and
compiles the equations once for each combination of scene parts (friction law, loading, fluid and so
on). The module ``compile_cache`` stores the compiled functions on disk, ``array_operations``
contains functions that replace Python functions in compiled code, and ``compilation_errors``
creates error messages.
"""
