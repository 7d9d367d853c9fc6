"""The class ``Scene``, which describes a spring-slider by its parts.

A scene consists of the slider parameters and one part per slot. All values are checked when the
scene is created.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from inspect import Parameter, Signature
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.slider import (
    fluid,
    friction,
    laws,
    loading,
    normal_stress,
    parameter_layout,
    part_registry,
    stability,
    temperature,
)
from rsfstudy.slider.dynamics.quasi_static import QuasiStatic
from rsfstudy.slider.loading.step import StepLoading
from rsfstudy.slider.noise.none import NoNoise
from rsfstudy.slider.parts import FloatTuple
from rsfstudy.slider.quantities_required_by_parts import check_needed_quantities
from rsfstudy.slider.scene_assembly import SceneParts
from rsfstudy.slider.scene_caching import cached_attribute
from rsfstudy.slider.scene_functions import SceneFunctions
from rsfstudy.slider.scene_quantities import SceneQuantities
from rsfstudy.slider.slider_parameters import SliderParameters
from rsfstudy.slider.state_variable_functions import check_steady_states_of_user_law

#: Maximum number of cached critical stiffnesses. Studies request the same values repeatedly along
#: axes that do not affect friction.
_CRITICAL_STIFFNESS_CACHE_SIZE = 4096
#: Segment table of loadings that consist of a single segment without an end.
SINGLE_ENDLESS_SEGMENT_TABLE = np.array([[0.0, math.inf, *[math.nan] * 4]])


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True, init=False, repr=False)
class Scene(SceneFunctions, SceneQuantities):
    r"""Spring-slider with rate- and state-dependent friction.

    The slider slides steadily at the reference velocity :math:`V_*` until the loading starts. A
    scene is immutable, and its values are checked when it is created. Quantities are dimensionless,
    with stress in :math:`\sigma_*`, slip in :math:`D_c`, time in :math:`D_c/V_*` and slip rate in
    :math:`V_*`. The method ``as_dict``, which returns the values of the fields, is inherited from
    ``SceneBase`` in ``slider.scene_base``.

    Parameters
    ----------
    law : str or type, default: "slip"
        State evolution law: "slip", "slowness" or the name of another module of
        ``rsfstudy.slider.laws``, or a user-defined class. The fields of a user-defined class become
        fields of the scene.
    normal_stress : str or type, default: "variable"
        Normal stress condition. With "constant", normal stress is constant. With "imposed", the
        normal stress is prescribed by the loading. With "variable", the driving stress is inclined
        at the angle ``phi``, and normal stress changes with shear stress. A user-defined class is
        also accepted. The default of ``Rig.scene`` is "constant".
    fluid : str or type, default: "drained"
        Pore fluid. With "drained", pore pressure is constant. With "dilatant", pore pressure falls
        when the slip rate increases. With "thermal", pore pressure rises when the fault heats up. A
        user-defined class is also accepted. Stress is normalised by the effective normal stress of
        steady sliding at :math:`V_*`. Pore pressure is relative to the pressure of the surroundings
        before the loading. The pore pressure is initially equal to the pressure of the
        surroundings, which can be changed by a history of pore pressure.
    temperature : str or type, default: "isothermal"
        Temperature. With "isothermal", temperature is constant. With "shear_heating", the work of
        the shear stress heats the fault. A user-defined class is also accepted.
    loading_noise : str or type, default: "none"
        Noise that is added to the loading. With "white", the noise of the stresses is a Wiener
        process. With "correlated", the noise has a correlation time and a limited variance.
    a : float, default: 0.0145
        Direct effect parameter.
    mu_star : float, default: 0.76
        Steady-state friction coefficient at :math:`V_*`.
    stiffness_ratio : float, optional
        Ratio of the stiffness to the critical stiffness at :math:`V_*` without inertia or radiation
        damping (see ``critical_stiffness``). If the slider moves at :math:`V_*` without inertia,
        steady sliding is stable at stiffness ratios above 1. With radiation damping, steady sliding
        is also stable at stiffness ratios slightly below 1. With inertia, steady sliding is
        unstable at stiffness ratios slightly above 1. If the law has several states, steady sliding
        may also be stable at lower stiffness ratios. The default is 1 if ``stiffness`` is not
        given.
    stiffness : float, optional
        Stiffness :math:`k D_c/\sigma_*`, as an alternative to ``stiffness_ratio``.
    period : float, default: 5.0
        Period :math:`T` of free oscillation in s. The product of ``period`` and ``reference_rate``
        determines the effect of inertia and the instability norm.
    reference_rate : float, default: 1.17e-8
        Reference rate :math:`V_*/D_c` in 1/s.
    instability_norm : float, default: 5e-4
        Threshold of instability. A motion is considered unstable if :math:`V T/(2 \pi D_c)` reaches
        the threshold.
    initial_stress : float, default: 0.0
        Initial shear stress minus the shear stress of steady sliding at :math:`V_*`, in
        :math:`\sigma_*`. The initial stress applies before the first step of the loading.
    initial_state : float, default: 0.0
        Initial state variable :math:`\Theta`, which is zero in steady sliding at :math:`V_*`.
    stress_dependence : float, default: 0.0
        Coefficient :math:`c` of Nagata et al. (2012). Shear stress decreases the state variable by
        :math:`c \, d\tau/\sigma`.
    regularised : bool, default: False
        If True, the regularised (arcsinh) form of the friction law is used. The slip rate then has
        the sign of the shear stress, so slip can reverse. Reversed slip requires quasi-static
        dynamics.
    b_over_a : float, default: 2.0
        Ratio :math:`b/a` of the evolution effect to the direct effect. Rate weakening requires
        :math:`b > a`. If friction is not rate weakening, there is no critical stiffness, so you
        must pass ``stiffness``.
    cutoff_velocity_ratio : float, default: 100.0
        Cut-off velocity :math:`V_c/V_*` of the composite law and of the law with a cut-off. Above
        this velocity, the composite law has no healing, and the law with a cut-off has no evolution
        effect.
    law_exponent : float, default: 0.5
        Exponent of the family of laws, from 0 (slip law) to 1 (slowness law).
    weakening_velocity_ratio : float, default: 1e5
        Weakening velocity :math:`V_w/V_*` of the law with flash heating.
    weakened_friction : float, default: 0.2
        Friction coefficient at slip rates far above the weakening velocity.
    weakening_exponent : float, default: 8.0
        Exponent :math:`n` of the law with flash heating. The transition at the weakening velocity
        is sharper if the exponent is larger.
    b1_over_a : float, default: 1.0
        Ratio :math:`b_1/a` of the first state, for laws with two states. Laws with two states do
        not have the field ``b_over_a``. Negative values are allowed.
    b2_over_a : float, default: 0.84
        Ratio :math:`b_2/a` of the second state, for laws with two states. Negative values are
        allowed.
    length_ratio : float, default: 1/0.048
        Ratio of the slip distance of the second state to :math:`D_c`, the slip distance of the
        first state.
    alpha : float, default: 0.56
        Coefficient of the effect of normal stress on the state variable. The field does not apply
        to constant normal stress. Zero disables the effect.
    phi : float, default: 60.0
        Angle in degrees between the driving stress and the fault normal, for variable normal
        stress.
    dilatancy : float, default: 0.01
        Dilatancy :math:`\epsilon/(\beta \sigma_*)` of the dilatant fluid: the decrease in pore
        pressure under undrained conditions if :math:`\ln V` increases by 1. If the dilatancy is
        negative, pores close when the slip rate increases. The default for the thermal fluid is 0.
    drainage : float, default: 1.0
        Drainage rate :math:`c^* D_c/V_*` of the dilatant or thermal fluid.
    porosity_length : float, default: 1.0
        Slip distance of the porosity of the dilatant or thermal fluid, in :math:`D_c`.
    pressurisation : float, default: 1.0
        Pressurisation factor :math:`\Lambda_p T_*/\sigma_*` of the thermal fluid: the increase in
        pore pressure under undrained conditions if the temperature rises by :math:`T_*`.
    inertia : bool, default: False
        If True, the slider has mass.
    radiation_damping : float, default: 0.0
        Damping coefficient :math:`\eta V_*/\sigma_*`, which is the damping stress due to seismic
        waves at :math:`V_*`. A scene has either inertia or radiation damping. The damping
        coefficient that corresponds to a slider with inertia is the stiffness multiplied by
        :math:`T V_*/(2 \pi D_c)`.
    oscillation_amplitude : float, default: 0.0
        Amplitude of an oscillation of imposed normal stress in :math:`\sigma_*`. If the driving
        stress is inclined, :math:`\sigma_3` oscillates. The field does not apply to constant normal
        stress.
    oscillation_period : float, default: 10.0
        Period of an oscillation of normal stress or load point velocity in :math:`D_c/V_*`.
    load_velocity_ratio : float, optional
        Load point velocity in :math:`V_*` after the step. The default is 0 after a step of
        displacement or normal stress, and 1 otherwise.
    oscillation_begin : float, optional
        Time in :math:`D_c/V_*` at which an oscillation begins. By default an oscillation begins
        immediately.
    oscillation_phase : float, optional
        Phase of an oscillation at its start, in degrees. By default, the phase is zero, so the
        oscillation starts as a sine.
    oscillation_cycles : float, optional
        Number of cycles after which an oscillation ends. The number may be fractional. By default
        an oscillation has no end.
    normal_stress_ramp : float, default: 0.0
        Change in imposed normal stress during a ramp, in :math:`\sigma_*`. If the driving stress is
        inclined, :math:`\sigma_3` changes. The field does not apply to constant normal stress.
    ramp_duration : float, default: 1.0
        Duration of the ramp of normal stress in :math:`D_c/V_*`.
    hold_time : float, default: 0.0
        Duration of a hold, during which the load point does not move, in :math:`D_c/V_*`. After the
        hold, the load point moves at ``load_velocity_ratio``.
    displacement_step : float, default: 0.0
        Sudden displacement of the load point in :math:`D_c`.
    normal_stress_step : float, default: 0.0
        Sudden change in imposed normal stress in :math:`\sigma_*`. If the driving stress is
        inclined, :math:`\sigma_3` changes. The field does not apply to constant normal stress.
    velocity_oscillation : float, optional
        Amplitude of an oscillation of the load point velocity, relative to the mean velocity
        ``load_velocity_ratio``. By default there is no oscillation.
    velocity_ramp : float, default: 0.0
        Change in the load point velocity during a ramp, in :math:`V_*`.
    velocity_ramp_duration : float, default: 10.0
        Duration of the ramp of load point velocity in :math:`D_c/V_*`.
    velocity_ramp_stairs : float, default: 64.0
        Number of steps that approximate the ramp of load point velocity.
    velocity_steps : float, default: 0.0
        Number of steps of load point velocity between :math:`V_*` and ``velocity_ratio``.
    velocity_ratio : float, default: 10.0
        Load point velocity in :math:`V_*` after the first velocity step.
    displacement_between_steps : float, default: 20.0
        Load point displacement between successive velocity steps in :math:`D_c`.
    heating : float, default: 1e-3
        Rise of the absolute temperature, relative to :math:`T_*`, due to a slip of :math:`D_c` at a
        shear stress of :math:`\sigma_*` without cooling.
    cooling : float, default: 1.0
        Cooling rate :math:`c_{th} D_c/V_*`, for scenes with shear heating.
    direct_activation, evolution_activation : float, default: 0.0
        Activation terms :math:`Q/(R T_*)` of the direct effect and of the evolution effect.
    stress_noise, normal_stress_noise : float, default: 0.0
        Amplitudes of the noise in shear stress and normal stress, in :math:`\sigma_*` per
        :math:`\sqrt{D_c/V_*}`.
    noise_interval : float, default: 0.05
        Sampling interval of the noise in :math:`D_c/V_*`.
    noise_seed : float, default: 0
        Seed of the noise, a whole number.
    noise_correlation_time : float, default: 1.0
        Correlation time of correlated noise in :math:`D_c/V_*`.
    dynamics : type, optional
        User-defined class of dynamics. By default the fields ``inertia`` and ``radiation_damping``
        select the dynamics, and motion is quasi-static if neither is set.
    loading : type or UserLoading, optional
        User-defined class of a loading, or a loading that ``rsfstudy.protocol``,
        ``rsfstudy.history`` or ``rsfstudy.read_protocol`` returns. By default, the loading is
        selected by other fields.

    Attributes
    ----------
    parts : SceneParts
        Parts of the scene: ``slider``, ``law``, ``normal_stress``, ``fluid``, ``dynamics``,
        ``loading``, ``temperature`` and ``loading_noise``. Each field of the scene belongs to one
        of the parts.

    Raises
    ------
    InvalidValue
        If a value violates its rule or does not apply in the scene. The error message contains the
        rule and a remedy.

    Examples
    --------
    >>> from rsfstudy import Scene
    >>> scene = Scene(law="slowness", normal_stress="constant", a=0.01, b_over_a=1.5)
    >>> round(scene.critical_stiffness, 6)
    0.005
    >>> faster = scene.with_(load_velocity_ratio=10.0)
    >>> faster.load_velocity
    10.0
    """

    parts: SceneParts

    #: Signature for code completion in editors.
    __signature__: ClassVar[Signature] = Signature(
        [
            Parameter(n, Parameter.KEYWORD_ONLY, default=d)
            for n, d in part_registry.collect_scene_field_defaults().items()
        ]
    )

    def _check_parts_and_compatibility(self) -> None:
        """Check each part, and the compatibility of the parts."""
        check_needed_quantities(self)
        # The law is checked last, because its check may compute steady sliding of the whole scene.
        for part in (*self.parts[:1], *reversed(self.parts[2:]), self.parts.law):
            part.check(self)
        if self.parts.law.name not in laws.BUILT_IN_LAW_CLASS_BY_NAME:
            check_steady_states_of_user_law(self)

    if TYPE_CHECKING:
        mu_star: float
        period: float
        reference_rate: float
        instability_norm: float
        initial_stress: float
        initial_state: float

    # ---- related scenes -------------------------------------------------------------------------

    def without_mass(self) -> Scene:
        """Return a copy of the scene with quasi-static dynamics instead of inertia.

        Returns
        -------
        Scene
            Scene without mass. If the scene has no mass, the method returns the scene itself.
        """
        return Scene(self.parts._replace(dynamics=QuasiStatic())) if self.has_mass else self

    def with_segment(self, segment: loading.Segment) -> Scene:
        """Return a copy of the scene whose loading consists of the given segment.

        Parameters
        ----------
        segment : Segment
            Segment of a loading.

        Returns
        -------
        Scene
            Scene with a step loading.
        """
        step = StepLoading(
            load_velocity_ratio=segment.load_velocity,
            displacement_step=segment.displacement,
            normal_stress_step=segment.normal_stress,
        )
        return Scene(self.parts._replace(loading=step))

    @property
    def steadily_loaded_scene(self) -> Scene:
        """Scene used in stability analyses, in which the load point moves steadily.

        If the loading has unknowns or noise, the load point of the returned scene moves at the
        velocity of the last segment, without noise. Otherwise the property returns the scene
        itself.
        """
        if not self.stress_imposing_part.unknowns and not self.parts.loading_noise.is_active:
            return self
        steady = self.with_segment(loading.Segment(self.load_velocity))
        return Scene(steady.parts._replace(loading_noise=NoNoise()))

    def segment_scene(self, segment_index: int) -> Scene:
        """Return a scene whose loading is one segment of the loading of this scene.

        Parameters
        ----------
        segment_index : int
            Index of the segment.

        Returns
        -------
        Scene
            Scene whose loading is the segment.
        """
        alone = self.parts.loading.isolate_segment(segment_index)
        if alone is self.parts.loading:
            return self
        if isinstance(alone, loading.Segment):
            return self.with_segment(alone)
        return Scene(self.parts._replace(loading=alone))

    @cached_attribute
    def segment_sequences_without_jumps(self) -> tuple[tuple[Scene, np.ndarray], ...]:
        """Sequences of loading segments that follow each other without a jump.

        A jump is a sudden change in load point displacement or normal stress, or the end of a
        segment with unknowns. If the scene has noise, each sequence has a single segment. Each
        sequence is a tuple of two elements: the scene during the first segment, and an array of
        shape (segments, 6) with the rows of the segment table. The columns of the table are defined
        in ``parameter_layout``.
        """
        if len(self._loading_segments) == 1:
            return ((self, SINGLE_ENDLESS_SEGMENT_TABLE),)
        table, breaks = map(
            np.array,
            (self.parts.loading.segment_table, self.parts.loading.jump_at_segment_start_mask),
        )
        if self.parts.law.regularised:  # After reversed slip, a hold may have no solution.
            breaks = breaks | (table[:, parameter_layout.SEGMENT_VELOCITY] == 0.0)
        breaks = breaks | self.parts.loading_noise.is_active
        first = np.flatnonzero(breaks[1:]) + 1
        acting = map(self.segment_scene, (0, *first.tolist()))
        return tuple(zip(acting, np.split(table, first), strict=True))

    # ---- equations ------------------------------------------------------------------------------

    @cached_attribute
    def result_cache(self) -> dict[tuple[Any, ...], Any]:
        """Cache for results that depend only on the scene."""
        return {}

    @cached_attribute
    def parameter_values(self) -> FloatTuple:
        """Parameters of the equations in the order of ``parameter_layout``."""
        return parameter_layout.pack_parameter_values(self)

    @cached_attribute
    def friction_parameter_values(self) -> FloatTuple:
        """Parameters for functions that depend only on friction.

        The elements that describe the spring and the load point are NaN.
        """
        return parameter_layout.pack_friction_parameter_values(self)

    @cached_attribute
    def friction_law_functions(self) -> friction.FrictionFunctions:
        """Functions that define the friction of the scene."""
        return friction.build_friction_functions(self)

    @cached_attribute
    def critical_stiffness(self) -> float:
        """Quasi-static critical stiffness at V_*, in units of sigma_*/D_c.

        The value includes the effects of the law, the normal stress condition (including
        ``alpha``), the fluid and the temperature. It does not include inertia, radiation damping,
        the loading or noise. For the critical stiffness with inertia or radiation damping, or at
        another slip rate, use ``critical_stiffness_at``. The value is 0 if steady sliding is stable
        at every stiffness, and infinite if steady sliding is unstable at every stiffness.
        """
        slider, law, stress, pores, *_others, heat, _noise = self.parts
        return _compute_cached_critical_stiffness(
            slider.a, slider.mu_star, law, stress, pores, heat
        )


part_registry.RESERVED_SCENE_ATTRIBUTE_NAMES.update(dir(Scene), Scene.__annotations__)


@lru_cache(_CRITICAL_STIFFNESS_CACHE_SIZE)
def _compute_cached_critical_stiffness(
    a: float,
    mu_star: float,
    law: laws.LawBase,
    normal_stress_part: normal_stress.NormalStress,
    fluid_part: fluid.Fluid,
    temperature_part: temperature.Temperature,
) -> float:
    """Compute the critical stiffness from the parts and parameters that define friction.

    The critical stiffness does not depend on the stiffness of the slider. The function therefore
    uses a slider with an arbitrary stiffness, equal to the parameter ``a``.
    """
    slider = SliderParameters(a=a, mu_star=mu_star, stiffness=a)
    others = QuasiStatic(), StepLoading(), temperature_part
    scene = Scene(SceneParts(slider, law, normal_stress_part, fluid_part, *others))
    return stability.compute_critical_stiffness(scene, 0.0, quasi_static=True)
