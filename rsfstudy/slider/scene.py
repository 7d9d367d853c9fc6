"""The Scene: which slider. The numbers that every slider has and what fills its five slots,
checked when made.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from inspect import Parameter, Signature
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.slider import (
    dynamics,
    fluid,
    laws,
    loading,
    normal_stress,
    parameter_layout,
    registry,
    scene_functions,
    stability,
)
from rsfstudy.slider.assembly import SceneBase, SceneParts
from rsfstudy.slider.caching import cached_attribute
from rsfstudy.slider.dynamics.quasi_static import QuasiStatic
from rsfstudy.slider.fluid._boundary_pressure import FluidWithBoundaryPressure
from rsfstudy.slider.loading.step import StepLoading
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.requirements import check_needs
from rsfstudy.slider.slider_parameters import SliderParameters
from rsfstudy.slider.states import check_steady_states

#: Critical stiffnesses that are kept: studies come back to those along their other axes.
_CACHE_SIZE = 4096
#: Table of the one segment of most loadings, which does not end.
ENDLESS_SEGMENT_TABLE = np.array([[0.0, math.inf, *[math.nan] * 4]])


@guard_methods
@dataclass(frozen=True, init=False, repr=False)
class Scene(SceneBase):
    """A spring-slider with rate- and state-dependent friction, sliding steadily at V_* until a step
    is imposed.

    Immutable and checked: a scene that exists is meaningful. Quantities are dimensionless, with
    stress in sigma_*, slip in D_c, time in D_c/V_* and slip rate in V_*.

    Parameters
    ----------
    law : str or type
        State evolution law: "slip" (default), "slowness" or any other file of
        `rsfstudy.slider.laws`, or a class of your own, whose fields are then fields of the scene.
    law_exponent : float, optional
        Exponent of the family of laws, from 0 (slip law) to 1 (slowness law); 0.5.
    cutoff_velocity_ratio : float, optional
        V_c/V_*, above which contact no longer heals by the composite law, and the evolution effect
        is left behind by the law with a cut-off; 100.
    stress_dependence : float
        c of Nagata et al. (2012): shear stress lowers the state variable by c dtau/sigma; 0.
    normal_stress : {"constant", "imposed", "variable"}, or type
        Constant; what the loading imposes; or, by default ("variable"), coupled to shear stress by
        a driving stress inclined at `phi`; or a class of your own.
    fluid : {"drained", "dilatant"}, or type
        Pore pressure that never changes ("drained", the default), or that falls where pores open
        with slip rate; or a class of your own. Stress is in units of the effective normal stress of
        steady sliding at V_*, so that pore pressure is counted from that of the surroundings, where
        it begins; a history of pore pressure changes that of the surroundings.
    dynamics, loading : type, optional
        A class of your own in these slots; or, as loading, what `rsfstudy.protocol` or
        `rsfstudy.history` made. Without them other fields fill these slots: by default motion is
        quasi-static, and the loading a single step, of nothing.
    alpha : float, optional
        Strength of the normal stress effect on the state variable (not at constant normal stress;
        0.56). Zero leaves the effect out.
    phi : float, optional
        Angle in degrees between the driving stress and the fault normal (variable normal stress
        only; 60).
    dilatancy, drainage : float, optional
        eps/(beta sigma_*), by which undrained pore pressure falls for each unit of ln V, and rate
        c* D_c/V_* at which it drains (dilatant fluid only; 0.01 and 1).
    a, b_over_a : float
        Direct effect, and evolution effect over direct effect; 0.0145 and 2. Rate weakening is b >
        a; without it there is no critical stiffness, and `stiffness` must be given.
    regularised : bool
        Whether slip reverses with shear stress (arcsinh form; quasi-static motion only); false.
    b1_over_a, b2_over_a, length_ratio : float, optional
        The same for each of two states (laws of two states only, instead of `b_over_a`), and the
        slip distance of the second over D_c, which is that of the first; 1, 0.84 and 1/0.048.
        Negative b are allowed.
    mu_star : float
        Steady-state friction coefficient at V_*; 0.76.
    stiffness_ratio : float, optional
        Stiffness over the critical stiffness at V_* without radiation damping. Above it steady
        sliding is stable; with damping also a little below. Default: 1. With several states a ratio
        below 1 need not be unstable.
    stiffness : float, optional
        Stiffness itself, k D_c/sigma_*, instead of its ratio.
    load_velocity_ratio : float, optional
        Load point velocity over V_* after the step. Default: 1, or 0 after a step of displacement
        or of normal stress.
    displacement_step : float
        Instantaneous displacement of the load point in D_c; 0.
    normal_stress_step : float
        Sudden change of imposed normal stress over sigma_* (not at constant normal stress); that of
        sigma_3 where a driving stress is inclined; 0.
    oscillation_amplitude, oscillation_period : float
        Amplitude over sigma_*, and period in D_c/V_*, of an oscillation of imposed normal stress
        that begins as sin(t) under a load point at `load_velocity_ratio` (not at constant normal
        stress; that of sigma_3 where a driving stress is inclined); 0, which is none, and 10.
    oscillation_begin, oscillation_phase, oscillation_cycles : float, optional
        Time in D_c/V_* at which an oscillation begins, of normal stress or of the load point, angle
        in degrees by which it is ahead of a sine then, and number of cycles after which it ends,
        whole or not. Default: it begins at once, as a sine, and goes on for ever.
    velocity_oscillation : float, optional
        Amplitude of an oscillation of load point velocity, over its mean at `load_velocity_ratio`,
        of the period, begin, phase and number of cycles above; none.
    normal_stress_ramp, ramp_duration : float
        Change of imposed normal stress over sigma_* at a steady rate, and time in D_c/V_* that it
        takes, under a load point at `load_velocity_ratio` (not at constant normal stress; that of
        sigma_3 where a driving stress is inclined); 0, which is none, and 1.
    hold_time : float
        Time in D_c/V_* for which the load point is held, before it moves on at
        `load_velocity_ratio`; 0, which is no hold.
    velocity_steps, velocity_ratio, displacement_between_steps : float
        How many steps of load point velocity there are, from V_* to `velocity_ratio` V_* and back
        in turn, and how far in D_c it moves from one to the next; 0, which is no step, 10 and 20.
    velocity_ramp, velocity_ramp_duration, velocity_ramp_stairs : float
        Change of load point velocity over V_* at a steady rate, time in D_c/V_* that it takes, and
        number of stairs that stand for it; 0, which is none, 10 and 64.
    inertia : bool
        Whether the slider has mass; false.
    radiation_damping : float
        eta V_*/sigma_*: stress that waves carry away at V_* (quasi-dynamic motion, instead of
        mass); T V_*/(2 pi D_c) times the stiffness is the impedance of spring and mass. Default: 0.
    period : float
        Period of free oscillation T in s; with `reference_rate` it sets inertia and the instability
        norm; 5.
    reference_rate : float
        V_*/D_c in 1/s; 1.17e-8.
    instability_norm : float
        A motion counts as unstable once V T/(2 pi D_c) reaches this norm; 5e-4.
    initial_stress, initial_state : float
        Shear stress over sigma_* above that of steady sliding at V_*, and state variable Theta,
        with which the slider begins, before the first step. Default: 0, steady sliding at V_*.

    Attributes
    ----------
    parts : SceneParts
        What it is made of: ``slider``, ``law``, ``normal_stress``, ``fluid``, ``dynamics`` and
        ``loading``; each field is that of one of them.

    Raises
    ------
    InvalidValue
        For a value that is wrong or means nothing, with the rule it breaks and the remedy.
    """

    parts: SceneParts

    #: What editors complete.
    __signature__: ClassVar[Signature] = Signature(
        [
            Parameter(n, Parameter.KEYWORD_ONLY, default=d)
            for n, d in registry.field_defaults().items()
        ]
    )

    def _check(self) -> None:
        check_needs(self)
        # the law last: it may ask what all of friction makes of steady sliding
        for part in (*self.parts[:1], *reversed(self.parts[2:]), self.parts.law):
            part.check(self)
        if self.parts.law.name not in laws.BUILT_IN_PARTS:
            check_steady_states(self)

    if TYPE_CHECKING:
        mu_star: float
        period: float
        reference_rate: float
        instability_norm: float
        initial_stress: float
        initial_state: float

    # ---- other scenes ---------------------------------------------------------------------------

    def without_mass(self) -> Scene:
        """This slider in quasi-static motion, if it has mass."""
        return Scene(self.parts._replace(dynamics=QuasiStatic())) if self.has_mass else self

    def with_segment(self, segment: loading.Segment) -> Scene:
        """This slider, loaded by one segment."""
        step = StepLoading(
            load_velocity_ratio=segment.load_velocity,
            displacement_step=segment.displacement,
            normal_stress_step=segment.normal_stress,
        )
        return Scene(self.parts._replace(loading=step))

    @property
    def under_steady_loading(self) -> Scene:
        """This slider under a load point that moves steadily, where its loading goes on
        changing normal stress: what steady sliding and its stability are asked of.
        """
        if not self.parts.loading.unknowns:
            return self
        return self.with_segment(loading.Segment(self.load_velocity))

    def segment_scene(self, index: int) -> Scene:
        """The scene as a segment of its loading has it."""
        alone = self.parts.loading.isolate_segment(index)
        if alone is self.parts.loading:
            return self
        if isinstance(alone, loading.Segment):
            return self.with_segment(alone)
        return Scene(self.parts._replace(loading=alone))

    @cached_attribute
    def continuous_segments(self) -> tuple[tuple[Scene, np.ndarray], ...]:
        """Its segments of loading as far as each follows on another without a jump: the scene as
        the first of them has it, and their table (see `parameter_layout`).
        """
        if len(self._segments) == 1:
            return ((self, ENDLESS_SEGMENT_TABLE),)
        table, breaks = map(
            np.array, (self.parts.loading.segment_table, self.parts.loading.jump_mask)
        )
        if self.parts.law.regularised:  # where slip has reversed, a hold may have no answer
            breaks = breaks | (table[:, parameter_layout.SEGMENT_VELOCITY] == 0.0)
        first = np.flatnonzero(breaks[1:]) + 1
        acting = map(self.segment_scene, (0, *first.tolist()))
        return tuple(zip(acting, np.split(table, first), strict=True))

    @cached_attribute
    def _segments(self) -> tuple[loading.Segment, ...]:
        return self.parts.loading.segments

    # ---- its equations --------------------------------------------------------------------------

    @cached_attribute
    def cache(self) -> dict[tuple[Any, ...], Any]:
        """Cache of what others make of it once and for all."""
        return {}

    @cached_attribute
    def numbers(self) -> Numbers:
        """All numbers, as the functions of the equations read them (see `parameter_layout`)."""
        return parameter_layout.pack_numbers(self)

    @cached_attribute
    def friction_numbers(self) -> Numbers:
        """Numbers for functions that friction alone decides."""
        return parameter_layout.pack_friction_numbers(self)

    @cached_attribute
    def functions(self) -> scene_functions.SceneFunctions:
        """The functions of the equations, by name (see `scene_functions`)."""
        return scene_functions.build_scene_functions(self)

    # ---- what follows from its fields -----------------------------------------------------------

    @property
    def dynamics(self) -> dynamics.Dynamics:
        """The part that balances the spring besides friction."""
        return self.parts.dynamics

    @cached_attribute
    def pressure_source(self) -> fluid.Fluid | loading.Loading | FluidWithBoundaryPressure:
        """The part whose last unknown takes from normal stress, if any has unknowns; two, where the
        loading imposes the pressure around a fluid.
        """
        imposed, pores = self.parts.loading, self.parts.fluid
        if not imposed.unknowns:
            return pores
        return FluidWithBoundaryPressure(imposed, pores) if pores.unknowns else imposed

    @property
    def has_mass(self) -> bool:
        """True if mass acts in ruptures."""
        return self.parts.dynamics.rupture_rate is not None

    @cached_attribute
    def state_count(self) -> int:
        """Number of states: those of the law, and the unknowns of a loading that goes on changing
        normal stress and of the fluid.
        """
        return self.parts.law.state_count + len(self.pressure_source.unknowns)

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that act in this scene."""
        return tuple(effect for part in self.parts for effect in part.effects)

    @cached_attribute
    def a(self) -> float:
        """Direct effect parameter."""
        return self.parts.slider.a

    @cached_attribute
    def b(self) -> float:
        """Evolution effect parameter, of all states together."""
        return float(self.parts.slider.a * self.parts.law.b_over_a)

    @property
    def stiffness(self) -> float:
        """K = k D_c/sigma_*."""
        given = self.parts.slider.stiffness
        return float(given) if given is not None else self._stiffness_from_ratio

    @cached_attribute
    def _stiffness_from_ratio(self) -> float:
        ratio = self.parts.slider.stiffness_ratio
        assert ratio is not None  # one of the two is given
        if not 0.0 < self.critical_stiffness < math.inf:
            rule = f"is of a critical stiffness at V_* that is {self.critical_stiffness:g}"
            raise InvalidValue("stiffness_ratio", ratio, rule, remedy="Give stiffness itself.")
        stiffness = float(ratio * self.critical_stiffness)
        if not stiffness > 0.0:
            rule = "is so small that the stiffness is rounded to 0"
            raise InvalidValue("stiffness_ratio", ratio, rule, remedy="Choose a larger ratio.")
        return stiffness

    @property
    def stiffness_ratio(self) -> float:
        """k/k_cr(V_*); infinite without rate weakening, where no spring is soft enough. One below 1
        need not be unstable with several states, which may be so between two stiffnesses only.
        """
        given = self.parts.slider.stiffness_ratio
        if given is not None:
            return float(given)
        return self.stiffness / self.critical_stiffness if self.critical_stiffness else math.inf

    @cached_attribute
    def load_velocity(self) -> float:
        """V_0/V_* after the last step."""
        return self._segments[-1].load_velocity

    @cached_attribute
    def log_load_velocity(self) -> float:
        """ln(V_0/V_*) of the magnitude of V_0, and -inf for a load point at rest."""
        return math.log(abs(self.load_velocity)) if self.load_velocity else -math.inf

    @cached_attribute
    def imposed_normal_stress(self) -> float:
        """By how much imposed normal stress exceeds sigma_* after the last step, over sigma_*."""
        return self._segments[-1].normal_stress

    @property
    def spring_stress_step(self) -> float:
        """Change of spring stress over sigma_* by the first displacement step, K d."""
        return self.stiffness * self._segments[0].displacement

    @property
    def is_perturbed(self) -> bool:
        """True if it does anything but slide on steadily at V_*."""
        return self.starts_unsteady or self.parts.loading.perturbs_steady_sliding

    @property
    def starts_unsteady(self) -> bool:
        """True if it begins with other stress or state than those of steady sliding at V_*."""
        return bool(self.parts.slider.initial_stress or self.parts.slider.initial_state)

    @cached_attribute
    def inertial_time(self) -> float:
        """Time scale of inertia in units of D_c/V_*: T V_*/(2 pi D_c).

        Slip rate in V_* times this number is what the instability norm is compared with.
        """
        slider = self.parts.slider
        return slider.period * slider.reference_rate / (2.0 * math.pi)

    @cached_attribute
    def log_instability_rate(self) -> float:
        """ln(V/V_*) at which the instability norm is reached."""
        return math.log(self.parts.slider.instability_norm / self.inertial_time)

    @cached_attribute
    def critical_stiffness(self) -> float:
        """Dimensionless critical stiffness k_cr(V_*) D_c/sigma_*.

        See ``stability.critical_stiffness``.
        """
        slider, law, stress, pores, *_others = self.parts
        return _critical_stiffness(slider.a, slider.mu_star, law, stress, pores)


registry.RESERVED_NAMES.update(dir(Scene), Scene.__annotations__)


@lru_cache(_CACHE_SIZE)
def _critical_stiffness(
    a: float,
    mu_star: float,
    law: laws.LawBase,
    stress: normal_stress.NormalStress,
    pores: fluid.Fluid,
) -> float:
    """That of any slider with this friction: of one whose spring is as stiff as a."""
    slider = SliderParameters(a=a, mu_star=mu_star, stiffness=a)
    scene = Scene(SceneParts(slider, law, stress, pores, QuasiStatic(), StepLoading()))
    return stability.critical_stiffness(scene, 0.0, quasi_static=True)
