"""The Scene: which slider. Four parts and the numbers every slider has, checked when made."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import FrozenInstanceError, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

from rsfstudy.errors import InvalidValue
from rsfstudy.slider import assembly, dynamics, laws, loading, normal_stress, steady
from rsfstudy.slider.dynamics.quasi_static import QuasiStatic
from rsfstudy.slider.fields import (
    SLOT_NAMES,
    SLOTS,
    Layout,
    chosen,
    layout_of,
    refuse_unless_idle,
    unknown_field,
    without_meaning,
)
from rsfstudy.slider.loading.step import Step
from rsfstudy.slider.parts import Numbers, Part, checked


class Parts(NamedTuple):
    """What fills the slots of a scene."""

    law: laws.Law
    normal_stress: normal_stress.NormalStress
    dynamics: dynamics.Dynamics
    loading: loading.Loading


class Scene:
    """A spring-slider with rate- and state-dependent friction, sliding steadily at V_* until a step
    is imposed.

    Immutable and checked: a scene that exists is meaningful. Quantities are dimensionless, with
    stress in sigma_*, slip in D_c, time in D_c/V_* and slip rate in V_*.

    Parameters
    ----------
    law : {"slip", "slowness"}, or type
        State evolution law; any file of `rsfstudy.slider.laws`, or a class of your own, whose
        fields are then fields of the scene.
    normal_stress : {"constant", "variable"}, or type
        Constant, or coupled to shear stress by a driving stress inclined at `phi`; or a class of
        your own.
    dynamics, loading : type, optional
        A class of your own in these slots, which other fields fill without it.
    alpha : float, optional
        Strength of the normal stress effect on the state variable (variable normal stress only;
        0.56). Zero leaves the effect out.
    phi : float, optional
        Angle in degrees between the driving stress and the fault normal (variable normal stress
        only; 60).
    a, b_over_a : float
        Direct effect, and evolution effect over direct effect. Rate weakening is b > a; without it
        there is no critical stiffness, and `stiffness` must be given.
    mu_star : float
        Steady-state friction coefficient at V_*.
    stiffness_ratio : float, optional
        Stiffness over the critical stiffness at V_*. Default: 1.
    stiffness : float, optional
        Stiffness itself, k D_c/sigma_*, instead of its ratio.
    load_velocity_ratio : float, optional
        Load point velocity over V_* after the step. Default: 1, or 0 after a displacement step.
    displacement_step : float
        Instantaneous displacement of the load point in D_c.
    inertia : bool
        Whether the slider has mass.
    radiation_damping : float
        eta V_*/sigma_*: stress that waves carry away at V_* (quasi-dynamic motion, instead of
        mass). Zero leaves the effect out; T V_*/(2 pi D_c) times the stiffness is the impedance of
        spring and mass.
    period : float
        Period of free oscillation T in s; with `reference_rate` it sets inertia and the instability
        norm.
    reference_rate : float
        V_*/D_c in 1/s.
    instability_norm : float
        A motion counts as unstable once V T/(2 pi D_c) reaches this norm.

    Attributes
    ----------
    parts : Parts
        What fills the slots: ``law``, ``normal_stress``, ``dynamics`` and ``loading``.

    Raises
    ------
    InvalidValue
        For a value that is wrong or means nothing, with the rule it breaks and the remedy.
    """

    parts: Parts
    _slider: Part
    _layout: Layout
    if TYPE_CHECKING:
        a: float
        mu_star: float
        period: float
        reference_rate: float
        instability_norm: float

        def __getattr__(self, name: str) -> Any: ...

    def __init__(self, **given: Any) -> None:
        layout = layout_of(tuple(chosen(slot, given) for slot in SLOTS))
        own: tuple[dict[str, Any], ...] = tuple({} for _part in layout.parts)
        for name, value in given.items():
            if name not in layout.fields and name not in SLOT_NAMES:
                raise unknown_field(name, value, layout)
            if value is None or name in SLOT_NAMES:
                continue
            place = layout.places.get(name)
            if place is None:
                refuse_unless_idle(name, value, layout.refusing[name])
            else:
                own[place][name] = checked(layout.parts[place], name, value)
        own[0].update(_spring(own[0]))
        made = [part(**values) for part, values in zip(layout.parts, own, strict=True)]
        self._fill(layout, made)

    def _fill(self, layout: Layout, made: Sequence[Part]) -> None:
        """Take the fields from the parts, and let the parts say whether they go together."""
        slider, *parts = made
        self.__dict__.update(layout.elsewhere, _layout=layout, _slider=slider)
        self.__dict__["parts"] = Parts(*parts)  # type: ignore[arg-type]
        for part in (slider, *parts):
            self.__dict__.update(part.__dict__)
        for part in parts:
            part.check(self)

    def __setattr__(self, name: str, value: Any) -> NoReturn:
        raise FrozenInstanceError(f"cannot assign to field {name!r}")

    def __delattr__(self, name: str) -> NoReturn:
        raise FrozenInstanceError(f"cannot delete field {name!r}")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Scene) and self.as_dict() == other.as_dict()

    def __hash__(self) -> int:
        return hash(tuple(self.as_dict().values()))

    def __repr__(self) -> str:
        return f"Scene({', '.join(f'{k}={v!r}' for k, v in self.as_dict().items())})"

    def __reduce__(self) -> tuple[Any, ...]:
        return _made, ({**self.as_dict(), **self._layout.own},)

    # ---- what follows from the parameters -------------------------------------------------------

    @property
    def dynamics(self) -> dynamics.Dynamics:
        """What balances the spring besides friction."""
        return self.parts.dynamics

    @property
    def has_mass(self) -> bool:
        """Whether mass acts in ruptures."""
        return self.parts.dynamics.rupture_rate is not None

    def without_mass(self) -> Scene:
        """The same slider in quasi-static motion, if it has mass."""
        if not self.has_mass:
            return self
        return self._with_parts(self.parts._replace(dynamics=QuasiStatic()))

    @property
    def b(self) -> float:
        """Evolution effect parameter."""
        return float(self.a * self.b_over_a)

    @cached_property
    def critical_stiffness(self) -> float:
        """k_cr(V_*) D_c/sigma_*, without mass or damping (see `steady.critical_stiffness`)."""
        return steady.critical_stiffness(self, 0.0, quasi_static=True)

    @cached_property
    def numbers(self) -> Numbers:
        """All numbers, as the functions of the equations read them (see `assembly`)."""
        return assembly.numbers(self)

    @property
    def stiffness(self) -> float:
        """K = k D_c/sigma_*."""
        given = self.__dict__["stiffness"]
        return float(
            self.__dict__["stiffness_ratio"] * self.critical_stiffness if given is None else given
        )

    @property
    def stiffness_ratio(self) -> float:
        """k/k_cr(V_*); infinite without rate weakening, where no spring is soft enough."""
        given = self.__dict__["stiffness_ratio"]
        if given is not None:
            return float(given)
        return self.stiffness / self.critical_stiffness if self.critical_stiffness else math.inf

    @property
    def load_velocity(self) -> float:
        """V_0/V_* after the last step."""
        return self.parts.loading.segments[-1].load_velocity

    @property
    def log_load_rate(self) -> float:
        """ln(V_0/V_*), and -inf for a load point at rest."""
        return math.log(self.load_velocity) if self.load_velocity > 0.0 else -math.inf

    @property
    def spring_stress_step(self) -> float:
        """Change of spring stress over sigma_* by the first displacement step, K d."""
        return self.stiffness * self.parts.loading.segments[0].displacement

    @property
    def segments(self) -> tuple[tuple[Scene, float], ...]:
        """The scene as each segment of its loading has it, and for how long, in D_c/V_*."""
        history = self.parts.loading.segments
        if len(history) == 1:
            return ((self, history[0].duration),)
        return tuple((self._under(segment), segment.duration) for segment in history)

    def _under(self, segment: loading.Segment) -> Scene:
        """The same slider, loaded by one segment."""
        step = Step(
            load_velocity_ratio=segment.load_velocity, displacement_step=segment.displacement
        )
        return self._with_parts(self.parts._replace(loading=step))

    def _with_parts(self, parts: Parts) -> Scene:
        """A copy with other parts in the slots."""
        scene = Scene.__new__(Scene)
        scene._fill(layout_of(tuple(type(part) for part in parts)), [self._slider, *parts])
        return scene

    @property
    def inertial_time(self) -> float:
        """Time scale of inertia in units of D_c/V_*: T V_*/(2 pi D_c).

        Slip rate in V_* times this number is what the instability norm is compared with.
        """
        return self.period * self.reference_rate / (2.0 * math.pi)

    @property
    def log_norm_rate(self) -> float:
        """ln(V/V_*) at which the instability norm is reached."""
        return math.log(self.instability_norm / self.inertial_time)

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that act in this scene."""
        return tuple(effect for part in self.parts for effect in part.effects)

    def with_(self, **changes: Any) -> Scene:
        """A copy with some fields changed, checked anew.

        Changing what fills a slot drops the fields that have no meaning any more; stiffness takes
        the place of its ratio, and the other way round.
        """
        plain = self._layout.plain
        if all(name in plain and value is not None for name, value in changes.items()):
            return self._with_numbers(changes)
        kept = {**self.as_dict(), **self._layout.own}
        for name in without_meaning({**kept, **changes}, self._layout.own.values()):
            kept.pop(name, None)
        if any(changes.get(name) is not None for name in _SPRING):
            kept |= dict.fromkeys(_SPRING)
        return Scene(**kept | changes)

    def _with_numbers(self, changes: Mapping[str, Any]) -> Scene:
        """A copy with the same parts, of which those that change are made and checked anew."""
        layout = self._layout
        made: list[Part] = [self._slider, *self.parts]
        for name, value in changes.items():
            place = layout.places.get(name)
            if place is None:
                raise layout.refusing[name].refuse(name, value)
            made[place] = replace(made[place], **{name: checked(layout.parts[place], name, value)})
        scene = Scene.__new__(Scene)
        scene._fill(layout, made)
        return scene

    def as_dict(self) -> dict[str, Any]:
        """The fields as plain Python values."""
        return {name: self.__dict__[name] for name in self._layout.fields}

    @property
    def own_parts(self) -> tuple[type[Part], ...]:
        """Those of its parts that are the user's own."""
        return tuple(self._layout.own.values())


#: The fields of which one sets the spring.
_SPRING = ("stiffness_ratio", "stiffness")


def _spring(values: dict[str, Any]) -> dict[str, Any]:
    """The numbers of a slider with one field for its spring."""
    given = [name for name in _SPRING if name in values]
    if len(given) == 2:
        rule = f"and stiffness_ratio = {values['stiffness_ratio']:g} both set the spring"
        raise InvalidValue("stiffness", values["stiffness"], rule, remedy="Give one of them.")
    return values if given else {**values, "stiffness_ratio": 1.0}


def _made(values: dict[str, Any]) -> Scene:
    return Scene(**values)
