"""The Scene: which slider. Four parts and the numbers every slider has, checked when made."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import FrozenInstanceError, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn, get_type_hints

from rsfstudy.errors import InvalidValue
from rsfstudy.quantity import Quantity
from rsfstudy.slider import assembly, dynamics, laws, loading, normal_stress, steady
from rsfstudy.slider.loading.step import Step
from rsfstudy.slider.parts import Numbers, Part, checked, names_of, number, quantities_of

_POSITIVE = "must be greater than 0"


@dataclass(frozen=True, kw_only=True)
class Slider(Part):
    """The numbers that every slider has."""

    a: float = number(0.0145, "$a$", "1", "direct effect parameter", rule=_POSITIVE)
    mu_star: float = number(
        0.76,
        r"$\mu_*$",
        "1",
        "steady-state friction coefficient at the reference rate",
        rule=_POSITIVE,
    )
    stiffness_ratio: float = number(
        1.0, r"$k/k_{cr}(V_*)$", "1", "stiffness over critical stiffness at V_star", rule=_POSITIVE
    )
    period: float = number(5.0, "$T$", "s", "period of free oscillation", rule=_POSITIVE)
    reference_rate: float = number(
        1.17e-8, "$V_*/D_c$", "s-1", "reference slip rate over slip distance", rule=_POSITIVE
    )
    instability_norm: float = number(
        5e-4, r"$VT/(2\pi D_c)$", "1", "slip rate norm that counts as unstable", rule=_POSITIVE
    )

    name = "slider"


@dataclass(frozen=True)
class _Slot:
    """What a scene has one of: the choices by name, and the one that is meant where none is
    named.
    """

    name: str
    choices: Mapping[str, type[Part]]
    default: str
    long_name: str

    @property
    def is_named(self) -> bool:
        """Whether a field of a scene names the choice; else a field of a part calls for it."""
        return not any(part.called_by for part in self.choices.values())

    @property
    def own(self) -> tuple[str, ...]:
        """The field that names the choice, if one does."""
        return (self.name,) if self.is_named else ()


SLOTS: tuple[_Slot, ...] = (
    _Slot("law", laws.PARTS, "slip", "state evolution law"),
    _Slot("normal_stress", normal_stress.PARTS, "variable", "normal stress condition"),
    _Slot("dynamics", dynamics.PARTS, "quasi_static", "what balances the spring besides friction"),
    _Slot("loading", loading.PARTS, "step", "what the load point does"),
)
#: Slots of which there is a choice to be named.
_NAMED = tuple(slot for slot in SLOTS if slot.is_named and len(slot.choices) > 1)
_EVERY_PART: tuple[type[Part], ...] = (
    Slider,
    *(part for slot in SLOTS for part in slot.choices.values()),
)
_OWNERS: Mapping[str, type[Part]] = {
    name: part for part in reversed(_EVERY_PART) for name in names_of(part)
}
#: Names of all fields of a scene.
FIELDS: tuple[str, ...] = tuple(
    dict.fromkeys(
        [*(slot.name for slot in _NAMED), *(n for part in _EVERY_PART for n in names_of(part))]
    )
)
#: What they mean.
QUANTITIES: tuple[Quantity, ...] = (
    *(Quantity(slot.name, "", "", slot.long_name) for slot in _NAMED),
    *(q for part in _EVERY_PART for q in quantities_of(part)),
)


def _kind(name: str) -> Any:
    """What a field of a scene holds; None where the part that owns it was not chosen."""
    part = _OWNERS[name]
    kind = get_type_hints(part)[name]
    chosen = (
        part is Slider
        or part.called_by
        or all(
            name in names_of(choice)
            for slot in SLOTS
            for choice in slot.choices.values()
            if part in slot.choices.values()
        )
    )
    return kind if chosen else kind | None


#: What the fields hold.
KINDS: Mapping[str, Any] = {slot.name: str for slot in _NAMED} | {n: _kind(n) for n in _OWNERS}


class Parts(NamedTuple):
    """What fills the slots of a scene."""

    law: laws.Law
    normal_stress: normal_stress.NormalStress
    dynamics: dynamics.Dynamics
    loading: Step


class Scene:
    """A spring-slider with rate- and state-dependent friction, sliding steadily at V_* until a step
    is imposed.

    Immutable and checked: a scene that exists is meaningful. Quantities are dimensionless, with
    stress in sigma_*, slip in D_c, time in D_c/V_* and slip rate in V_*.

    Parameters
    ----------
    law : {"slip", "slowness"}
        State evolution law; any file of `rsfstudy.slider.laws`.
    normal_stress : {"constant", "variable"}
        Constant, or coupled to shear stress by a driving stress inclined at `phi`.
    alpha : float, optional
        Strength of the normal stress effect on the state variable (variable normal stress only;
        0.56). Zero leaves the effect out.
    phi : float, optional
        Angle in degrees between the driving stress and the fault normal (variable normal stress
        only; 60).
    a, b_over_a : float
        Direct effect, and evolution effect over direct effect; b > a, rate weakening.
    mu_star : float
        Steady-state friction coefficient at V_*.
    stiffness_ratio : float
        Stiffness over the critical stiffness at V_*.
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
    if TYPE_CHECKING:
        a: float
        mu_star: float
        stiffness_ratio: float
        period: float
        reference_rate: float
        instability_norm: float

        def __getattr__(self, name: str) -> Any: ...

    def __init__(self, **given: Any) -> None:
        for name in given:
            if name not in FIELDS:
                raise unknown_field(name)
        chosen = {slot.name: _chosen(slot, given) for slot in SLOTS}
        values = dict.fromkeys(FIELDS)
        values |= {slot.name: chosen[slot.name].name for slot in _NAMED}
        slider = Slider(**_values(Slider, given))
        parts = Parts(**{name: part(**_values(part, given)) for name, part in chosen.items()})  # type: ignore[arg-type]
        for slot in SLOTS:
            _refuse_others(slot, chosen[slot.name], given, values)
        for part in (slider, *parts):
            values |= {name: getattr(part, name) for name in names_of(type(part))}
        self.__dict__.update(values, parts=parts)
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
        return _made, (self.as_dict(),)

    # ---- what follows from the parameters -------------------------------------------------------

    @property
    def dynamics(self) -> dynamics.Dynamics:
        """What balances the spring besides friction."""
        return self.parts.dynamics

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
        return self.stiffness_ratio * self.critical_stiffness

    @property
    def load_velocity(self) -> float:
        """V_0/V_* after the step."""
        return self.parts.loading.load_velocity

    @property
    def log_load_rate(self) -> float:
        """ln(V_0/V_*), and -inf for a load point at rest."""
        return math.log(self.load_velocity) if self.load_velocity > 0.0 else -math.inf

    @property
    def spring_stress_step(self) -> float:
        """Change of spring stress over sigma_* by the displacement step."""
        return self.parts.loading.spring_stress(self.stiffness)

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

        Changing what fills a slot drops the fields that have no meaning any more.
        """
        for name in sorted(changes):
            if name not in FIELDS:
                raise unknown_field(name)
        kept = self.as_dict()
        for slot in _NAMED:
            part = slot.choices.get(changes.get(slot.name, kept[slot.name]))
            if part is not None:
                others = {n for other in slot.choices.values() for n in names_of(other)}
                kept |= dict.fromkeys(others - set(names_of(part)))
        return Scene(**kept | changes)

    def as_dict(self) -> dict[str, Any]:
        """The fields as plain Python values."""
        return {name: self.__dict__[name] for name in FIELDS}


def _made(values: dict[str, Any]) -> Scene:
    return Scene(**values)


def _chosen(slot: _Slot, given: Mapping[str, Any]) -> type[Part]:
    """The part that is asked for in a slot."""
    if slot.is_named:
        name = given.get(slot.name, slot.default)
        if not isinstance(name, str) or name not in slot.choices:
            raise InvalidValue(slot.name, name, "is unknown", choices=slot.choices)
        return slot.choices[name]
    for part in slot.choices.values():
        value = given.get(part.called_by)
        if value is not None and checked(part, part.called_by, value):
            return part
    return slot.choices[slot.default]


def _values(part: type[Part], given: Mapping[str, Any]) -> dict[str, Any]:
    """What is given for the fields of a part, checked; what is not stays as it is by default."""
    names = (name for name in names_of(part) if given.get(name) is not None)
    return {name: checked(part, name, given[name]) for name in names}


def _refuse_others(
    slot: _Slot, chosen: type[Part], given: Mapping[str, Any], values: dict[str, Any]
) -> None:
    """Refuse values for the fields of parts that were not chosen, but for what calls none of them:
    a field that calls for a part is there in every scene, with the value that does not.
    """
    for part in slot.choices.values():
        for name in set(names_of(part)) - set(names_of(chosen)):
            value = given.get(name)
            if name == part.called_by:
                values[name] = part.__dataclass_fields__[name].default
                if value is None or not checked(part, name, value):
                    continue
            if value is not None:
                raise chosen.refuse(name, value)


def unknown_field(name: str) -> InvalidValue:
    """The error for a name that is no field of a scene."""
    return InvalidValue("field", name, "is not a field of a scene", choices=FIELDS)
