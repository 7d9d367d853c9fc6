"""The states of a law, which act on friction together."""

from __future__ import annotations

from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.slots import A, others_moved, others_scaled


def total(numbers: Numbers) -> float:
    """Sum of what several states contribute."""
    together = 0.0
    for number in numbers:
        together += number
    return together


def only(numbers: Numbers) -> float:
    """The same, of one state."""
    return numbers[0]


def felt(changes: Numbers, friction: float, psis: Numbers, p: Numbers) -> float:
    """What changes of the states take from a ln(V/V_*): ``a d ln V = strength'(g) dg - felt``."""
    return total(changes)


def felt_of_one(changes: Numbers, friction: float, psis: Numbers, p: Numbers) -> float:
    """The same, of one state."""
    return changes[0]


def states_at(value: float, log_rate: float, others: Numbers, p: Numbers) -> Numbers:
    """All states, where friction has this strength: the first is what the others leave."""
    return (value - p[A] * log_rate - total((0.0, *others)), *others)


def moved(psis: Numbers, changes: Numbers, by: float) -> Numbers:
    """States after so many times their changes."""
    return (psis[0] + by * changes[0], *others_moved(psis[1:], changes[1:], by))


def only_moved(psis: Numbers, changes: Numbers, by: float) -> Numbers:
    """The same, of one state."""
    return (psis[0] + by * changes[0],)


def scaled(numbers: Numbers, by: float) -> Numbers:
    """So many times each of some numbers."""
    return (by * numbers[0], *others_scaled(numbers[1:], by))


def only_scaled(numbers: Numbers, by: float) -> Numbers:
    """The same, of one number."""
    return (by * numbers[0],)
