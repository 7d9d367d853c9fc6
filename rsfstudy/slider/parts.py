"""Parts: each is one choice of a slot of the slider, with its fields and its functions of floats.

A scene fills five slots: state evolution law, normal stress, fluid, dynamics and loading. Each
choice is one file, with a frozen dataclass derived from `Part` that owns its fields: default, rule,
symbol, units and description. Its functions are plain functions of floats: they take the numbers of
a scene as one flat tuple ``p``, in which those of the part begin at the place of its slot, such as
``p[LAW]`` (see `parameter_layout`). `friction` and `scene_functions` put them together.

What an effect of your own overrides: how the state evolves, a `Law` (`evolution`) or a
`LawBase` (`evolutions`, `steady_states`; whatever weakens friction may be a state); how normal
stress follows shear stress, a `NormalStress`; unknowns that end in a pore pressure, a `Fluid`; how
slip rate follows stress, a `Dynamics`; what moves the load point, a `Loading` or a protocol.
"""

from __future__ import annotations

import importlib
import math
import pkgutil
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, fields
from functools import cache
from numbers import Real
from typing import TYPE_CHECKING, Any, ClassVar

from rsfstudy._deprecation import (
    adopt_former_members,
    renamed_keywords,
    renamed_members,
    renamed_names,
)
from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.quantities import Quantity
from rsfstudy.slider.scene_view import SceneView

#: Rules of most fields; counts are of segments of loading.
POSITIVE, NON_NEGATIVE = "must be greater than 0", "must be 0 or greater"
NON_NEGATIVE_INTEGER, POSITIVE_INTEGER = (
    f"must be a whole number from {least} to 100,000" for least in (0, 1)
)
_BOOLEAN_RULE = "must be true or false"

#: A function of floats, the last argument being the numbers of a scene.
Function = Callable[..., Any]
Numbers = tuple[float, ...]


@renamed_members
@guard_methods
@dataclass(frozen=True, kw_only=True)
class Part:
    """Base of all parts.

    One of a user's own is given by its class: ``Scene(law=MyLaw)``.
    """

    #: What the part is called; a part that a field calls for by its value names that field instead.
    name: ClassVar[str]
    selected_by: ClassVar[str] = ""
    #: What follows from the equations of a part and is stated beside them, and the members that
    #: hold those: a part with one of them of its own inherits no conclusion from another's.
    derived_properties: ClassVar[tuple[str, ...]] = ()
    defining_methods: ClassVar[frozenset[str]] = frozenset()
    #: Unknowns of a fluid or a loading, and the functions of them (see `fluid.Fluid`).
    unknowns: ClassVar[tuple[Quantity, ...]] = ()
    #: Names of unknowns that do not count for the distance from steady sliding, for example because
    #: their steady values are huge at the slip rate of a rupture. Motions may settle, and limit
    #: cycles are recognised, whatever these unknowns do.
    excluded_from_distance: ClassVar[tuple[str, ...]] = ()
    #: Quantities that the rates of a part need, and those that the functions of its slot receive
    #: (names of `requirements.PART_QUANTITIES`). A scene refuses a part if it cannot provide a
    #: quantity.
    needs: ClassVar[Collection[str]] = frozenset()
    received_quantities: ClassVar[frozenset[str]] = frozenset()
    auxiliary_rates: ClassVar[Function | None] = None
    auxiliary_steady_states: ClassVar[Function | None] = None
    #: Where values of other parts of the slot have no meaning, and what would give them one.
    rejection_hint: ClassVar[tuple[str, str]] = ("", "")

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        adopt_former_members(cls)
        if cls.defining_methods & vars(cls).keys():
            base = next(kind for kind in cls.__mro__ if "derived_properties" in vars(kind))
            for name in cls.derived_properties:
                if name not in vars(cls):
                    setattr(cls, name, vars(base)[name])

    def numbers(self, scene: SceneView) -> Numbers:
        """Return the values that the functions of the part read from ``p``.

        The first value is stored at the place of the slot. A law can have any number of values. The
        other kinds of part have room for a few values only (see ``parameter_layout``). Fields that
        a subclass declares with ``number`` are appended in the order of their declaration. Override
        this method only if the functions read values other than these fields.
        """
        return ()

    def check(self, scene: SceneView) -> None:
        """Raise InvalidValue where its values do not go with one another or with the scene."""

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that act through this part."""
        return ()

    @classmethod
    def required_functions(cls) -> tuple[str, ...]:
        """Names of the functions that the part must state."""
        return ("auxiliary_rates", "auxiliary_steady_states") if cls.unknowns else ()

    @classmethod
    def rejection_error(cls, name: str, value: Any) -> InvalidValue:
        """The error for a value of another part of the slot, which has no meaning here."""
        where, instead = cls.rejection_hint
        rule = f"has no meaning {where or f'for {cls.name}'}"
        remedy = f"Leave {name} out, or {instead}." if instead else "Leave it out."
        return InvalidValue(name, value, rule, remedy=remedy)

    def field_error(self, name: str, rule: str, remedy: str = "") -> InvalidValue:
        """The error for what one of its fields holds."""
        return InvalidValue(name, getattr(self, name), rule, remedy=remedy)


@renamed_keywords
def number(
    default: float | None,
    symbol: str,
    units: str,
    long_name: str,
    scale: str = "",
    *,
    rule: str = "",
    remedy: str = "",
    omit_if_none: bool = False,
) -> Any:
    """Declare a numeric field of a part.

    Parameters
    ----------
    default : float or None
        Default value.
    symbol, units, long_name, scale : str
        Description of the field, for tables, figures and files.
    rule : str
        Condition that values must satisfy, a key of ``RULES``.
    remedy : str
        Last sentence of the error message if a value violates the rule.
    omit_if_none : bool
        If True, the field is included among the values of a scene only if the user sets the field.
        Use True for fields that were introduced later, so that the file names of existing results
        do not change.
    """
    if rule not in RULES:
        raise InvalidValue("rule", rule, "is unknown", choices=RULES)
    about = {"symbol": symbol, "units": units, "long_name": long_name, "scale": scale}
    metadata = {"about": about, "rule": rule, "remedy": remedy, "omit_if_none": omit_if_none}
    return field(default=default, metadata=metadata)


def flag(default: bool, long_name: str) -> Any:
    """A field that is true or false."""
    about = {"symbol": "", "units": "", "long_name": long_name}
    return field(default=default, metadata={"about": about, "rule": _BOOLEAN_RULE, "remedy": ""})


#: What numbers may have to be.
RULES: Mapping[str, Callable[[float], bool]] = {
    "": lambda value: True,
    POSITIVE: lambda value: value > 0.0,
    NON_NEGATIVE: lambda value: value >= 0.0,
    NON_NEGATIVE_INTEGER: lambda value: value.is_integer() and 0.0 <= value <= 1e5,
    POSITIVE_INTEGER: lambda value: value.is_integer() and 1.0 <= value <= 1e5,
    "must be greater than -1": lambda value: value > -1.0,
    "must be -1 or greater": lambda value: value >= -1.0,
    "must lie between 0 and 1": lambda value: 0.0 <= value <= 1.0,
}


def is_boolean_field(part: type[Part], name: str) -> bool:
    """True if a field of a part holds true or false."""
    return bool(part.__dataclass_fields__[name].metadata["rule"] == _BOOLEAN_RULE)


def field_names(part: type[Part]) -> tuple[str, ...]:
    """Names of the fields that a part brings to a scene, made by `number` or `flag`: first that
    which calls for it, if one does. Cells of journals are known by their fields in this order.
    """
    names = (f.name for f in fields(part) if "about" in f.metadata)
    return tuple(sorted(names, key=lambda name: name != part.selected_by))


@cache
def _appended_fields(part: type[Part]) -> tuple[str, ...]:
    """Return the names of the fields declared below the last ``numbers`` override.

    The list contains number fields only. Their values are appended to the values that the override
    returns.
    """
    overriding = next(kind for kind in part.__mro__ if "numbers" in vars(kind))
    known = vars(overriding).get("__dataclass_fields__", {})
    return tuple(
        name for name in field_names(part) if name not in known and not is_boolean_field(part, name)
    )


def collect_numbers(part: Part, scene: SceneView) -> Numbers:
    """Return the values of ``part.numbers``, followed by the appended fields."""
    values = (getattr(part, name) for name in _appended_fields(type(part)))  # type: ignore[arg-type]
    others = (math.nan if value is None else float(value) for value in values)
    return (*part.numbers(scene), *others)


def field_quantities(part: type[Part]) -> list[Quantity]:
    """Quantities that the fields of a part hold."""
    stated = (part.__dataclass_fields__[name] for name in field_names(part))
    return [Quantity(f.name, **f.metadata["about"]) for f in stated]


@cache
def _field_rule(
    part: type[Part], name: str
) -> tuple[Any, str, str, Callable[[float], bool] | None]:
    """The default of a field, its rule, the remedy, and whether a number keeps to the rule."""
    stated = part.__dataclass_fields__[name]
    rule = stated.metadata["rule"]
    return stated.default, rule, stated.metadata["remedy"], RULES.get(rule)


def validate_value(part: type[Part], name: str, value: Any) -> Any:
    """A value for a field of a part, as Python's own number or flag.

    Raises
    ------
    InvalidValue
        Where it is none, or breaks the rule of the field.
    """
    default, rule, remedy, allows = _field_rule(part, name)  # type: ignore[arg-type]
    if type(value) is float and math.isfinite(value) and allows and allows(value):
        return value  # as most are
    if value is None and default is None:
        return None
    flagged = type(value).__name__ == "bool"  # numpy's too
    if rule == _BOOLEAN_RULE:
        if not flagged:
            raise InvalidValue(name, value, rule)
        return bool(value)
    if flagged or not isinstance(value, Real):
        has_units = isinstance(value, str) and value.strip()[:1].isdigit()
        remedy = "Units are those of a rig: state it, as rsfstudy.Rig." * has_units
        raise InvalidValue(name, value, "must be a number", remedy=remedy)
    try:
        plain = float(value)
    except OverflowError:
        plain = math.inf
    except TypeError as error:  # NumPy counts intervals of time among its integers
        raise InvalidValue(name, value, "must be a number") from error
    if not math.isfinite(plain):
        raise InvalidValue(name, plain, "must be finite")
    if not RULES[rule](plain):
        raise InvalidValue(name, plain, rule, remedy=remedy)
    return plain


def discover_parts(package: str, path: Iterable[str]) -> dict[str, type[Part]]:
    """The parts of a folder, by name: one in each of its files."""
    parts: dict[str, type[Part]] = {}
    for file in sorted(module.name for module in pkgutil.iter_modules(path)):
        if file.startswith("_"):  # what several share
            continue
        module = importlib.import_module(f"{package}.{file}")
        own = [p for p in vars(module).values() if isinstance(p, type) and issubclass(p, Part)]
        parts |= {p.name: p for p in own if p.__module__ == module.__name__}
    return parts


if not TYPE_CHECKING:
    __getattr__ = renamed_names(__name__)
