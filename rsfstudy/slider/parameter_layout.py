"""Indices of the numbers of a scene in the flat tuple ``p``, which its equations read; and bounds
of what these compute.

Those that every scene has come first. Each slot has places of its own behind them: a law reads
``p[LAW]``, ``p[LAW + 1]``, ... The law stands last, and may have any number of them.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

from rsfstudy._deprecation import renamed_names
from rsfstudy.errors import InvalidValue
from rsfstudy.slider.parts import Numbers, Part, collect_numbers
from rsfstudy.slider.scene_view import SceneView

#: Direct effect parameter a; how far ln V moves the states, which is b for one; mu_*, K = k
#: D_c/sigma_*, V_0/V_*, its logarithm, the effect c of shear stress on the state, and by how much
#: the loading has raised normal stress, over sigma_*.
(
    A,
    B,
    MU_STAR,
    STIFFNESS,
    LOAD_VELOCITY,
    LOG_LOAD_VELOCITY,
    STRESS_DEPENDENCE,
    IMPOSED_NORMAL_STRESS,
) = range(8)

#: Where the numbers of each slot begin, by its name. A loading that has unknowns has the places of
#: the fluid, which then has none. There are few: compiled functions hand on all of `p`.
NORMAL_STRESS, FLUID, DYNAMICS, LAW = 8, 10, 13, 15
LOADING = FLUID
#: Where both have some, the rate of the loading stands behind the numbers of the fluid.
BOUNDARY_PRESSURE_RATE = DYNAMICS - 1

#: Columns of the table of segments of a loading: when each begins and ends, V_0/V_* and its
#: logarithm, and the rate and the fall of normal stress that a loading with unknowns imposes as it
#: begins, NaN of others.
(
    SEGMENT_START,
    SEGMENT_END,
    SEGMENT_VELOCITY,
    SEGMENT_LOG_VELOCITY,
    SEGMENT_STRESS_RATE,
    SEGMENT_STRESS_FALL,
) = range(6)

#: Slip rates of which ln(V/V_*) is beyond this occur in trial steps only, which the integrator
#: rejects: a motion ends at 276 (`slip_rate_unbounded`).
LARGEST_LOG_SLIP_RATE = 300.0
#: The same of time over slip, 1/V: slip that no load moves stops at 10^-290 V_*.
LARGEST_LOG_SLOWNESS = 680.0
#: Normal stress over its reference value, less 1: outside of these in trial steps only; clamps keep
#: it finite.
SMALLEST_NORMAL_STRESS_EXCESS, LARGEST_NORMAL_STRESS_EXCESS = 1e-12 - 1.0, 1e12


class _NumberSource(Protocol):
    """Part, or combination of parts, with numbers for the functions of a scene."""

    @property
    def name(self) -> str: ...

    def numbers(self, scene: SceneView) -> Numbers: ...


def pack_numbers(scene: SceneView) -> Numbers:
    """The numbers of a scene, each in its place."""
    p = scene.friction_numbers
    of_load = scene.stiffness, scene.load_velocity, scene.log_load_velocity
    return (*p[:STIFFNESS], *of_load, *p[STRESS_DEPENDENCE:])


def pack_friction_numbers(scene: SceneView) -> Numbers:
    """Numbers for functions that friction alone decides: NaN for spring and load point."""
    parts, slider, law = scene.parts, scene.parts.slider, scene.parts.law
    size = slider.a * law.state_change_over_a
    size = math.copysign(size, law.b_over_a) if law.state_count == 1 else size
    of_load = math.nan, math.nan, math.nan
    of_stress = law.stress_dependence, scene.imposed_normal_stress
    common = slider.a, size, slider.mu_star, *of_load, *of_stress
    own = (
        *_pad_with_nan(parts.normal_stress, scene, FLUID - NORMAL_STRESS),
        *_pad_with_nan(scene.pressure_source, scene, DYNAMICS - FLUID),
        *_pad_with_nan(parts.dynamics, scene, LAW - DYNAMICS),
    )
    return (*common, *own, *collect_numbers(law, scene))


def _pad_with_nan(part: _NumberSource, scene: SceneView, length: int) -> Numbers:
    """The numbers of a part, and NaN in the places that it leaves, so that who reads there reads
    nothing.
    """
    own = collect_numbers(part, scene) if isinstance(part, Part) else part.numbers(scene)
    if len(own) > length:
        rule = f"states {len(own)} numbers, and there are places for {length}"
        raise InvalidValue("numbers", part.name, rule, remedy="Make fewer of them, as quotients.")
    return (*own, *(math.nan,) * (length - len(own)))


if not TYPE_CHECKING:
    __getattr__ = renamed_names(__name__)
