"""What parts may call without knowing which part answers: `assembly` fills it in.

Places of the numbers that every scene has, in the flat tuple ``p``, and the functions that the
parts of a scene supply. Called from here, a function says that it has not been filled in.
"""

from __future__ import annotations

from typing import Any, NoReturn

from rsfstudy.slider.parts import Numbers

#: Direct and evolution effect parameters a and b, mu_*, K = k D_c/sigma_*, V_0/V_*, its logarithm.
A, B, MU_STAR, STIFFNESS, LOAD_VELOCITY, LOG_LOAD_RATE = range(6)
#: Where the numbers of the first part begin.
FIRST_OWN = 6

#: Exponents beyond this occur in trial steps only, which the integrator rejects: a motion ends at
#: ln(V/V_*) = 276 (`slip_rate_unbounded`).
LARGEST_EXPONENT = 300.0


def _open(*_arguments: float | Numbers) -> NoReturn:
    raise TypeError("a slot of the equations that no part of a scene has filled")


def strength(friction: float, p: Numbers) -> tuple[float, float, float, float]:
    """The friction relation (see `friction`)."""
    _open(friction, p)


def normal_stress(friction: float, p: Numbers) -> tuple[float, float]:
    """Normal stress over its reference value less 1, and its derivative (see `normal_stress`)."""
    _open(friction, p)


def state_effect(friction: float, ratio: float, change: float, p: Numbers) -> tuple[float, float]:
    """State lost to the present stress, and its derivative."""
    _open(friction, ratio, change, p)


def other_state_effect(
    friction: float, ratio: float, change: float, p: Numbers
) -> tuple[float, float]:
    """The same by another part."""
    _open(friction, ratio, change, p)


def evolution(log_rate: float, state: float, p: Numbers) -> float:
    """Evolution of the state per unit slip, for a law of one state (see `laws`)."""
    _open(log_rate, state, p)


def evolutions(log_rate: float, psis: Numbers, shift: float, share: float, p: Numbers) -> Numbers:
    """Evolution of all states per unit slip, times a share (see `laws`)."""
    _open(log_rate, psis, shift, share, p)


def resting(log_rate: float, shift: float, p: Numbers) -> Numbers:
    """The states of steady sliding (see `laws`)."""
    _open(log_rate, shift, p)


def evolving(log_rate: float, psis: Numbers, shift: float, p: Numbers) -> Numbers:
    """Evolution of all states per unit of slip and load point displacement together (see
    `forms`).
    """
    _open(log_rate, psis, shift, p)


def balance(spring: float, psis: Numbers, p: Numbers) -> tuple[float, float, float]:
    """ln(V/V_*), frictional stress and state lost to stress (see `dynamics`)."""
    _open(spring, psis, p)


def growth(state: Numbers, rates: Numbers, x: float, friction: float, p: Numbers) -> float:
    """Derivative of ln V along the motion (see `dynamics`)."""
    _open(state, rates, x, friction, p)


def point_at(
    log_rate: float, growth: float, spring: float, friction: float, psis: Numbers, p: Numbers
) -> tuple[Any, ...]:
    """What the slider does at one instant (see `forms.Point`)."""
    _open(log_rate, growth, spring, friction, psis, p)
