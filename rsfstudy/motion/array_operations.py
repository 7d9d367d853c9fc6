"""Array operations that the event loop calls in plain Python.

In plain Python, the arrays are memory views, and the equations are functions that fill arrays. In
compiled code, arrays are represented by pointers and functions by addresses, so
``compiled.array_operations`` provides replacements for the functions of this module.
"""

from __future__ import annotations


def evaluate_function_into_array(function, y, rates, parameters, result):
    """Call a function that fills an output array.

    If the equations overflow, for example in a user-defined law, the results remain NaN as in
    compiled code. The stepper then rejects the step.

    Parameters
    ----------
    function : callable
        One of the functions in ``in_place_functions.InPlaceFunctions``.
    y, rates, parameters : array
        Arguments of the function.
    result : array
        Output array.
    """
    try:
        function(y, rates, parameters, result)
    except OverflowError:
        return  # The function has filled its results with NaN before it evaluated the equations.


def convert_array_to_pointer(array):
    """Convert an array to an argument of ``advance_pointer_by_items``.

    Parameters
    ----------
    array : array
        Array to convert.

    Returns
    -------
    array
        The array itself.
    """
    return array


def advance_pointer_by_items(array, item_count):
    """Return a view of an array that begins at a given index.

    Parameters
    ----------
    array : array
        Array to slice.
    item_count : int
        Number of items to skip.

    Returns
    -------
    array
        View of the remaining items.
    """
    return array[item_count:]


def copy_values(source, target, item_count):
    """Copy the first items of an array to another array.

    Parameters
    ----------
    source, target : array
        Array to copy from, and array to copy to.
    item_count : int
        Number of items.
    """
    target[:item_count] = source[:item_count]
