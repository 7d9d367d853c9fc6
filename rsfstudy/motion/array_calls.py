"""Calls of the loop of motions on its arrays and equations, in plain Python.

Uncompiled, arrays are memoryviews, and an equation is a function that fills one. The compiler has
pointers and addresses in their place (`compiled.calls`).
"""

from __future__ import annotations


def evaluate(function, y, rates, p, result):
    """Have a function of the equations fill `result`."""
    function(y, rates, p, result)


def as_pointer(array):
    """An array from its first number on."""
    return array


def offset_by(array, count):
    """An array from so many numbers further on."""
    return array[count:]


def copy_values(source, target, count):
    """Copy so many numbers."""
    target[:count] = source[:count]
