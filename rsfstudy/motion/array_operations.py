"""Calls of the loop of motions on its arrays and equations, in plain Python.

Uncompiled, arrays are memoryviews, and an equation is a function that fills one. The compiler has
pointers and addresses in their place (`compiled.calls`).
"""

from __future__ import annotations


def evaluate_in_place(function, y, rates, parameters, result):
    """Have a function of the equations fill `result`."""
    function(y, rates, parameters, result)


def array_as_pointer(array):
    """An array from its first number on."""
    return array


def offset_pointer(array, item_count):
    """An array from so many numbers further on."""
    return array[item_count:]


def copy_values(source, target, item_count):
    """Copy so many numbers."""
    target[:item_count] = source[:item_count]
