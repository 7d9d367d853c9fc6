"""What parts may call without knowing which part answers: `assembly` fills it in.

Places of the numbers that every scene has, in the flat tuple ``p``, and the functions that the
parts of a scene supply. Called from here, a function says that it has not been filled in.
"""

from __future__ import annotations

from typing import Any, NoReturn

from rsfstudy.slider.parts import Numbers

#: Direct and evolution effect parameters a and b, mu_*, K = k D_c/sigma_*, V_0/V_*, its logarithm,
#: the effect c of shear stress on the state, how far ln V moves the states, which is b for one, and
#: by how much the loading has raised normal stress, over sigma_*.
A, B, MU_STAR, STIFFNESS, LOAD_VELOCITY, LOG_LOAD_RATE, STRESS_DEPENDENCE, SIZE, IMPOSED = range(9)
#: Where the numbers of the first part begin.
FIRST_OWN = 9

#: Exponents beyond this occur in trial steps only, which the integrator rejects: a motion ends at
#: ln(V/V_*) = 276 (`slip_rate_unbounded`).
LARGEST_EXPONENT = 300.0
#: The same of time over slip, 1/V: slip that no load moves stops at 10^-290 V_*.
LARGEST_SLOWNESS = 680.0
#: Normal stress ratios outside of these only occur in trial steps; clamps keep them finite.
SMALLEST_RATIO, LARGEST_RATIO = 1e-12, 1e12


def _open(*_arguments: float | Numbers) -> NoReturn:
    raise TypeError("a slot of the equations that no part of a scene has filled")


def strength(friction: float, psis: Numbers, p: Numbers) -> tuple[float, float, float, float]:
    """The friction relation (see `friction`); the first of the states may be missing."""
    _open(friction, psis, p)


def one_way(friction: float, psis: Numbers, p: Numbers) -> tuple[float, float, float, float]:
    """The friction relation of slip forward, where slip may reverse."""
    _open(friction, psis, p)


def normal_stress(friction: float, p: Numbers) -> tuple[float, float]:
    """Normal stress over its reference value less 1, and its derivative (see `normal_stress`)."""
    _open(friction, p)


def effective_stress(friction: float, psis: Numbers, p: Numbers) -> tuple[float, float]:
    """The same of effective normal stress."""
    _open(friction, psis, p)


def effective_stress_change(
    friction: float, friction_change: float, changes: Numbers, p: Numbers
) -> float:
    """Change of effective normal stress (see `forms`)."""
    _open(friction, friction_change, changes, p)


def outer_stress(friction: float, psis: Numbers, p: Numbers) -> tuple[float, float]:
    """The same of normal stress less the pore pressure outside the fault, which a rig knows of."""
    _open(friction, psis, p)


def outer_stress_change(
    friction: float, friction_change: float, changes: Numbers, p: Numbers
) -> float:
    """Change of that (see `forms`)."""
    _open(friction, friction_change, changes, p)


def state_effect(friction: float, ratio: float, change: float, p: Numbers) -> tuple[float, float]:
    """State lost to the present stress, and its derivative."""
    _open(friction, ratio, change, p)


def other_state_effect(
    friction: float, ratio: float, change: float, p: Numbers
) -> tuple[float, float]:
    """The same by another part."""
    _open(friction, ratio, change, p)


def felt(changes: Numbers, friction: float, psis: Numbers, p: Numbers) -> float:
    """What changes of the states take from a ln(V/V_*) (see `states`)."""
    _open(changes, friction, psis, p)


def moved(psis: Numbers, changes: Numbers, by: float) -> Numbers:
    """States after so many times their changes (see `states`)."""
    _open(psis, changes, by)


def others_moved(psis: Numbers, changes: Numbers, by: float) -> Numbers:
    """The same of all but the first."""
    _open(psis, changes, by)


def scaled(numbers: Numbers, by: float) -> Numbers:
    """So many times each of some numbers (see `states`)."""
    _open(numbers, by)


def others_scaled(numbers: Numbers, by: float) -> Numbers:
    """The same of all but the first."""
    _open(numbers, by)


def changes(state: Numbers, p: Numbers) -> Numbers:
    """Derivatives of the unknowns in the clock of a form (see `forms`)."""
    _open(state, p)


def rupture_rate(state: Numbers, p: Numbers) -> Numbers:
    """Derivatives of the unknowns of the full equations, in inertial time (see `dynamics`)."""
    _open(state, p)


def rupture_point(state: Numbers, rates: Numbers, p: Numbers) -> tuple[Any, ...]:
    """What the slider does where mass acts (see `dynamics`)."""
    _open(state, rates, p)


def evolution(log_rate: float, state: float, p: Numbers) -> float:
    """Evolution of the state per unit slip, for a law of one state (see `laws`)."""
    _open(log_rate, state, p)


def evolutions(log_rate: float, psis: Numbers, shift: float, share: float, p: Numbers) -> Numbers:
    """Evolution of all states per unit slip, times a share (see `laws`)."""
    _open(log_rate, psis, shift, share, p)


def resting(log_rate: float, shift: float, p: Numbers) -> Numbers:
    """The states of steady sliding (see `laws`)."""
    _open(log_rate, shift, p)


def evolutions_of_law(
    log_rate: float, psis: Numbers, shift: float, share: float, p: Numbers
) -> Numbers:
    """The same of the states of the law alone, where a fluid has others."""
    _open(log_rate, psis, shift, share, p)


def resting_of_law(log_rate: float, shift: float, p: Numbers) -> Numbers:
    """The states of the law in steady sliding, where a fluid has others."""
    _open(log_rate, shift, p)


def seepage(log_rate: float, states: Numbers, share: float, p: Numbers) -> Numbers:
    """Changes of the states of a fluid per unit slip, times a share (see `fluid`)."""
    _open(log_rate, states, share, p)


def seeped(log_rate: float, p: Numbers) -> Numbers:
    """The states of a fluid in steady sliding (see `fluid`)."""
    _open(log_rate, p)


def strength_of_pressure(friction: float, psis: Numbers, p: Numbers) -> tuple[float, float]:
    """Derivatives of strength and shift with respect to pore pressure (see `saturated`)."""
    _open(friction, psis, p)


def pace(log_rate: float, p: Numbers) -> tuple[float, float, float]:
    """ln(V/V_*), V_0/V and V/(V + V_0) (see `forms`)."""
    _open(log_rate, p)


def balance(spring: float, psis: Numbers, p: Numbers) -> tuple[float, float, float]:
    """ln(V/V_*), frictional stress and state lost to stress (see `dynamics`)."""
    _open(spring, psis, p)


def growth(state: Numbers, rates: Numbers, x: float, friction: float, p: Numbers) -> float:
    """Derivative of ln V along the motion (see `dynamics`)."""
    _open(state, rates, x, friction, p)


def reading_growth(
    spring: float,
    spring_change: float,
    friction: float,
    friction_change: float,
    psis: Numbers,
    changes: Numbers,
    p: Numbers,
) -> float:
    """Change of the friction coefficient that is read (see `forms`)."""
    _open(spring, spring_change, friction, friction_change, psis, changes, p)


def point_at(
    log_rate: float,
    growth: float,
    spring: float,
    friction: float,
    psis: Numbers,
    reading_growth: float,
    p: Numbers,
) -> tuple[Any, ...]:
    """What the slider does at one instant (see `forms.Point`)."""
    _open(log_rate, growth, spring, friction, psis, reading_growth, p)
