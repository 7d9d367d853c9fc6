"""Parts: each is one choice of a slot of the slider, with its fields and its functions of floats.

A scene fills five slots: state evolution law, normal stress, fluid, dynamics and loading. Each
choice is one file, with a frozen dataclass derived from `Part` that owns its fields: default, rule,
symbol, units and description. Its functions are plain functions of floats: they take the numbers of
a scene as one flat tuple ``p``, in which those of the part begin at the place of its slot, such as
``p[LAW]`` (see `places`). `friction` and `system` put them together.

What an effect of your own overrides: how the state evolves, a `Law` (`evolution`) or a
`LawOfStates` (`evolutions`, `steady_states`; whatever weakens friction may be a state); how normal
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

from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.quantity import Quantity

if TYPE_CHECKING:
    from rsfstudy.slider.scene import Scene as Scene
else:  # parts name it in annotations only, and a scene is made of them
    Scene = Any

#: Rules of most fields; counts are of segments of loading.
POSITIVE, NOT_NEGATIVE = "must be greater than 0", "must be 0 or greater"
ANY_COUNT, COUNT = (f"must be a whole number from {least} to 100,000" for least in (0, 1))
_FLAG = "must be true or false"
#: Names that members of a user's own part may still bear.
_FORMER_NAMES = {
    "resting": "steady_states",
    "stress_left": "relaxation",
    "seepage": "auxiliary_rates",
    "seeped": "auxiliary_steady_states",
}

#: A function of floats, the last argument being the numbers of a scene.
Function = Callable[..., Any]
Numbers = tuple[float, ...]


@guard_methods
@dataclass(frozen=True, kw_only=True)
class Part:
    """Base of all parts.

    One of a user's own is given by its class: ``Scene(law=MyLaw)``.
    """

    #: What the part is called; a part that a field calls for by its value names that field instead.
    name: ClassVar[str]
    called_by: ClassVar[str] = ""
    #: What follows from the equations of a part and is stated beside them, and the members that
    #: hold those: a part with one of them of its own inherits no conclusion from another's.
    conclusions: ClassVar[tuple[str, ...]] = ()
    equations: ClassVar[frozenset[str]] = frozenset()
    #: Unknowns of a fluid or a loading, and the functions of them (see `fluid.Fluid`).
    unknowns: ClassVar[tuple[Quantity, ...]] = ()
    #: Names of unknowns that do not count for the distance from steady sliding, for example because
    #: their steady values are huge at the slip rate of a rupture. Motions may settle, and limit
    #: cycles are recognised, whatever these unknowns do.
    excluded_from_distance: ClassVar[tuple[str, ...]] = ()
    #: Quantities that the rates of a part need, and those that the functions of its slot receive
    #: (names of `requirements.QUANTITIES`). A scene refuses a part if it cannot provide a quantity.
    needs: ClassVar[Collection[str]] = frozenset()
    receives: ClassVar[frozenset[str]] = frozenset()
    auxiliary_rates: ClassVar[Function | None] = None
    auxiliary_steady_states: ClassVar[Function | None] = None
    #: Where values of other parts of the slot have no meaning, and what would give them one.
    no_meaning: ClassVar[tuple[str, str]] = ("", "")

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        for former, name in _FORMER_NAMES.items():
            if former in vars(cls):
                setattr(cls, name, vars(cls)[former])
        if cls.equations & vars(cls).keys():
            base = next(kind for kind in cls.__mro__ if "conclusions" in vars(kind))
            for name in cls.conclusions:
                if name not in vars(cls):
                    setattr(cls, name, vars(base)[name])

    def numbers(self, scene: Scene) -> Numbers:
        """Return the values that the functions of the part read from ``p``.

        The first value is stored at the place of the slot. A law can have any number of values. The
        other kinds of part have room for a few values only (see ``places``). Fields that a subclass
        declares with ``number`` are appended in the order of their declaration. Override this
        method only if the functions read values other than these fields.
        """
        return ()

    def check(self, scene: Scene) -> None:
        """Raise InvalidValue where its values do not go with one another or with the scene."""

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that act through this part."""
        return ()

    @classmethod
    def functions(cls) -> tuple[str, ...]:
        """Names of the functions that the part must state."""
        return ("auxiliary_rates", "auxiliary_steady_states") if cls.unknowns else ()

    @classmethod
    def refuse(cls, name: str, value: Any) -> InvalidValue:
        """The error for a value of another part of the slot, which has no meaning here."""
        where, instead = cls.no_meaning
        rule = f"has no meaning {where or f'for {cls.name}'}"
        remedy = f"Leave {name} out, or {instead}." if instead else "Leave it out."
        return InvalidValue(name, value, rule, remedy=remedy)

    def invalid(self, name: str, rule: str, remedy: str = "") -> InvalidValue:
        """The error for what one of its fields holds."""
        return InvalidValue(name, getattr(self, name), rule, remedy=remedy)


def number(
    default: float | None,
    symbol: str,
    units: str,
    long_name: str,
    scale: str = "",
    *,
    rule: str = "",
    remedy: str = "",
    if_stated: bool = False,
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
    if_stated : bool
        If True, the field is included among the values of a scene only if the user sets the field.
        Use True for fields that were introduced later, so that the file names of existing results
        do not change.
    """
    if rule not in RULES:
        raise InvalidValue("rule", rule, "is unknown", choices=RULES)
    about = {"symbol": symbol, "units": units, "long_name": long_name, "scale": scale}
    metadata = {"about": about, "rule": rule, "remedy": remedy, "if_stated": if_stated}
    return field(default=default, metadata=metadata)


def flag(default: bool, long_name: str) -> Any:
    """A field that is true or false."""
    about = {"symbol": "", "units": "", "long_name": long_name}
    return field(default=default, metadata={"about": about, "rule": _FLAG, "remedy": ""})


#: What numbers may have to be.
RULES: Mapping[str, Callable[[float], bool]] = {
    "": lambda value: True,
    POSITIVE: lambda value: value > 0.0,
    NOT_NEGATIVE: lambda value: value >= 0.0,
    ANY_COUNT: lambda value: value.is_integer() and 0.0 <= value <= 1e5,
    COUNT: lambda value: value.is_integer() and 1.0 <= value <= 1e5,
    "must be greater than -1": lambda value: value > -1.0,
    "must be -1 or greater": lambda value: value >= -1.0,
    "must lie between 0 and 1": lambda value: 0.0 <= value <= 1.0,
}


def is_flag(part: type[Part], name: str) -> bool:
    """True if a field of a part holds true or false."""
    return bool(part.__dataclass_fields__[name].metadata["rule"] == _FLAG)


def names_of(part: type[Part]) -> tuple[str, ...]:
    """Names of the fields that a part brings to a scene, made by `number` or `flag`: first that
    which calls for it, if one does. Cells of journals are known by their fields in this order.
    """
    names = (f.name for f in fields(part) if "about" in f.metadata)
    return tuple(sorted(names, key=lambda name: name != part.called_by))


@cache
def _appended(part: type[Part]) -> tuple[str, ...]:
    """Return the names of the fields declared below the last ``numbers`` override.

    The list contains number fields only. Their values are appended to the values that the override
    returns.
    """
    overriding = next(kind for kind in part.__mro__ if "numbers" in vars(kind))
    known = vars(overriding).get("__dataclass_fields__", {})
    return tuple(name for name in names_of(part) if name not in known and not is_flag(part, name))


def numbers_of(part: Part, scene: Scene) -> Numbers:
    """Return the values of ``part.numbers``, followed by the appended fields."""
    values = (getattr(part, name) for name in _appended(type(part)))  # type: ignore[arg-type]
    others = (math.nan if value is None else float(value) for value in values)
    return (*part.numbers(scene), *others)


def quantities_of(part: type[Part]) -> list[Quantity]:
    """Quantities that the fields of a part hold."""
    stated = (part.__dataclass_fields__[name] for name in names_of(part))
    return [Quantity(f.name, **f.metadata["about"]) for f in stated]


@cache
def _stated(part: type[Part], name: str) -> tuple[Any, str, str, Callable[[float], bool] | None]:
    """The default of a field, its rule, the remedy, and whether a number keeps to the rule."""
    stated = part.__dataclass_fields__[name]
    rule = stated.metadata["rule"]
    return stated.default, rule, stated.metadata["remedy"], RULES.get(rule)


def checked(part: type[Part], name: str, value: Any) -> Any:
    """A value for a field of a part, as Python's own number or flag.

    Raises
    ------
    InvalidValue
        Where it is none, or breaks the rule of the field.
    """
    default, rule, remedy, allows = _stated(part, name)  # type: ignore[arg-type]
    if type(value) is float and math.isfinite(value) and allows and allows(value):
        return value  # as most are
    if value is None and default is None:
        return None
    flagged = type(value).__name__ == "bool"  # numpy's too
    if rule == _FLAG:
        if not flagged:
            raise InvalidValue(name, value, rule)
        return bool(value)
    if flagged or not isinstance(value, Real):
        has_units = isinstance(value, str) and value.strip()[:1].isdigit()
        remedy = "Units are those of a rig: state it, as rsfstudy.Laboratory." * has_units
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


def found_in(package: str, path: Iterable[str]) -> dict[str, type[Part]]:
    """The parts of a folder, by name: one in each of its files."""
    parts: dict[str, type[Part]] = {}
    for file in sorted(module.name for module in pkgutil.iter_modules(path)):
        if file.startswith("_"):  # what several share
            continue
        module = importlib.import_module(f"{package}.{file}")
        own = [p for p in vars(module).values() if isinstance(p, type) and issubclass(p, Part)]
        parts |= {p.name: p for p in own if p.__module__ == module.__name__}
    return parts
