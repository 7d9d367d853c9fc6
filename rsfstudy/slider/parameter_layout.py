"""Layout of the parameter tuple ``p`` that the equations of a scene read.

The tuple starts with the parameters that every scene has. The parameters of the parts follow in the
order of the slots. The parameters of the law are ``p[LAW]``, ``p[LAW + 1]`` and so on. The
parameters of the law follow the parameters of all other parts, because a law can have any number of
parameters. If the temperature changes, the parameters of the temperature come after the parameters
of the law. In a scene with noise, the last two parameters are the inertial time and the rate at
which noise changes the spring stress. The module also defines the columns of segment tables, and
limits that prevent numerical overflow.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

from rsfstudy._deprecation import build_getattr_for_former_names
from rsfstudy.errors import InvalidValue
from rsfstudy.slider.parts import FloatTuple, Part, collect_parameter_values
from rsfstudy.slider.scene_view import SceneView

#: Indices of the parameters that every scene has: the direct effect parameter a, the change in the
#: states per unit of ln V (b for a law with one state), the friction coefficient mu_*, the
#: stiffness K = k D_c/sigma_*, the load point velocity V_0/V_* and its logarithm, the effect c of
#: shear stress on the state, and the imposed change in normal stress in sigma_*.
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

#: Index of the first parameter of each slot. A loading with unknowns stores its parameters in the
#: elements that are reserved for the parameters of the fluid. The parameter tuple is kept short,
#: because compiled functions copy all of its elements in each call.
NORMAL_STRESS, FLUID, DYNAMICS, LAW = 8, 10, 13, 15
LOADING = FLUID
#: Index of the rate of the imposed pressure if both the loading and the fluid have parameters.
BOUNDARY_PRESSURE_RATE = DYNAMICS - 1

#: Columns of the segment table of a loading: start time, end time, load point velocity V_0/V_*, its
#: logarithm, rate of normal stress, and decrease in normal stress at the start. The last two
#: columns are NaN if the loading has no unknowns. The segment tables of noise have another column,
#: the rate at which noise changes the spring stress.
(
    SEGMENT_START,
    SEGMENT_END,
    SEGMENT_VELOCITY,
    SEGMENT_LOG_VELOCITY,
    SEGMENT_STRESS_RATE,
    SEGMENT_STRESS_FALL,
    SEGMENT_NOISE_RATE,
) = range(7)

#: Upper limit of ln(V/V_*). Larger slip rates occur only in trial steps that the integrator
#: rejects, because a motion ends at ln(V/V_*) = 276 with the status ``slip_rate_unbounded``.
LOG_SLIP_RATE_UPPER_LIMIT = 300.0
#: Upper limit of ln(V_*/V). Without loading, slip is treated as stopped at a slip rate of 10^-290
#: V_*.
LOG_SLOWNESS_UPPER_LIMIT = 680.0
#: Limits of the normal stress ratio minus one. Normal stress ratios outside these limits occur only
#: in trial steps of the integrator.
SMALLEST_NORMAL_STRESS_EXCESS, LARGEST_NORMAL_STRESS_EXCESS = 1e-12 - 1.0, 1e12


class _HasParameterValues(Protocol):
    """Protocol for parts, or combinations of parts, that provide parameters."""

    @property
    def name(self) -> str: ...

    def parameter_values(self, scene: SceneView) -> FloatTuple: ...


def pack_parameter_values(scene: SceneView) -> FloatTuple:
    """Return a tuple with all parameters of a scene.

    Parameters
    ----------
    scene : Scene
        Scene to convert.

    Returns
    -------
    tuple of float
        Parameters in the order defined by the constants of ``parameter_layout``.
    """
    p = scene.friction_parameter_values
    of_load = scene.stiffness, scene.load_velocity, scene.log_load_velocity
    return (*p[:STIFFNESS], *of_load, *p[STRESS_DEPENDENCE:])


def pack_friction_parameter_values(scene: SceneView) -> FloatTuple:
    """Return the parameter tuple for functions that depend only on friction.

    Parameters
    ----------
    scene : Scene
        Scene to convert.

    Returns
    -------
    tuple of float
        Parameters in the order defined by the constants of ``parameter_layout``. The elements that
        describe the spring and the load point are NaN.
    """
    parts, slider, law = scene.parts, scene.parts.slider_parameters, scene.parts.law
    size = slider.a * law.steady_state_change_per_log_rate_over_a
    size = math.copysign(size, law.b_over_a) if law.state_count == 1 else size
    of_load = math.nan, math.nan, math.nan
    of_stress = law.stress_dependence, scene.imposed_normal_stress
    common = slider.a, size, slider.mu_star, *of_load, *of_stress
    own = (
        *_pad_part_parameters_with_nan(parts.normal_stress, scene, FLUID - NORMAL_STRESS),
        *_pad_part_parameters_with_nan(
            scene.part_changing_effective_stress, scene, DYNAMICS - FLUID
        ),
        *_pad_part_parameters_with_nan(parts.dynamics, scene, LAW - DYNAMICS),
    )
    last = collect_parameter_values(law, scene), pack_temperature_parameter_values(scene)
    # The last parameter of a scene with noise is the rate at which noise changes the spring stress.
    noise = (scene.inertial_time, 0.0) if parts.loading_noise.is_active else ()
    return (*common, *own, *last[0], *last[1], *noise)


def pack_temperature_parameter_values(scene: SceneView) -> FloatTuple:
    """Return the parameters that the equations for the fault temperature use.

    Parameters
    ----------
    scene : Scene
        Scene to convert.

    Returns
    -------
    tuple of float
        Activation terms multiplied by a and b, the pressurisation factor of the fluid, and the
        parameters of the temperature part. The tuple is empty if the temperature is constant.
    """
    temperature = scene.parts.temperature
    if not temperature.unknowns:
        return ()
    direct, evolution = temperature.dimensionless_activation_energies
    common = scene.a * direct, scene.b * evolution, scene.parts.fluid.pressurisation_factor
    return (*common, *collect_parameter_values(temperature, scene))


def _pad_part_parameters_with_nan(
    part: _HasParameterValues, scene: SceneView, padded_length: int
) -> FloatTuple:
    """Return the parameters of a part, padded with NaN.

    Because of the padding, a function that reads an unused element returns NaN instead of a wrong
    number.
    """
    own = (
        collect_parameter_values(part, scene)
        if isinstance(part, Part)
        else part.parameter_values(scene)
    )
    if len(own) > padded_length:
        rule = f"has {len(own)} parameters, but at most {padded_length} are allowed"
        raise InvalidValue(
            "parameter_values",
            part.name,
            rule,
            remedy="Combine parameters, for example as quotients.",
        )
    return (*own, *(math.nan,) * (padded_length - len(own)))


if not TYPE_CHECKING:
    __getattr__ = build_getattr_for_former_names(__name__)
