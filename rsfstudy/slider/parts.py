"""Base class and field declarations of the parts of a slider.

A scene has seven slots: the state evolution law, the normal stress condition, the pore fluid, the
dynamics, the loading, the temperature and the noise. Each choice for a slot is a frozen dataclass
derived from ``Part``, usually in its own module. The class declares the fields of the part with the
functions ``number`` and ``flag``.

The functions of a part are plain functions of floats. The functions receive the parameters of a
scene as a flat tuple ``p``. The parameters of a part start at the index of its slot, for example
``p[LAW]`` (see ``parameter_layout``). The modules ``friction`` and ``equations`` combine the
functions of all parts.

To add an effect, derive a class from the base class of a slot:

- ``Law`` or ``LawBase`` defines the evolution of the state. Any quantity that weakens friction can
  be modelled as a state.
- ``NormalStress`` defines the dependence of normal stress on shear stress.
- ``Fluid`` defines unknowns that determine the pore pressure.
- ``Dynamics`` defines the dependence of the slip rate on stress.
- ``Loading`` defines the motion of the load point.
- ``Temperature`` defines how the temperature of the fault changes.
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
    accept_former_keyword_names,
    add_former_member_names,
    build_getattr_for_former_names,
    copy_former_overrides_to_new_names,
)
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.quantities import Quantity
from rsfstudy.slider.scene_view import SceneView

#: Validation rules that most fields use. The upper limit in the rules for integers limits the
#: number of loading segments.
POSITIVE, NON_NEGATIVE = "must be greater than 0", "must be 0 or greater"
NON_NEGATIVE_INTEGER, POSITIVE_INTEGER = (
    f"must be a whole number from {least} to 100,000" for least in (0, 1)
)
_BOOLEAN_FIELD_RULE_TEXT = "must be true or false"

#: Function of floats whose last argument is the parameter tuple of a scene.
NumericFunction = Callable[..., Any]
FloatTuple = tuple[float, ...]


@add_former_member_names
@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True, kw_only=True)
class Part:
    """Base class of all parts of a slider.

    To use a user-defined part, pass its class to the scene, for example ``Scene(law=MyLaw)``.

    Examples
    --------
    >>> from rsfstudy import Scene
    >>> from rsfstudy.parts import Part
    >>> scene = Scene(law="slowness")
    >>> all(isinstance(part, Part) for part in scene.parts)
    True
    >>> scene.parts.law.name
    'slowness'
    """

    #: Name of the part.
    name: ClassVar[str]
    #: Name of the field whose value selects the part. The string is empty if the part is selected
    #: by its name.
    field_name_that_selects_part: ClassVar[str] = ""
    #: Names of class members that are derived from the equations of the part, such as closed-form
    #: solutions.
    members_derived_from_equations: ClassVar[tuple[str, ...]] = ()
    #: Names of class members that define the equations. If a subclass overrides one of these
    #: members, the subclass does not inherit ``members_derived_from_equations``.
    members_defining_equations: ClassVar[frozenset[str]] = frozenset()
    #: Unknowns of a fluid or a loading. The functions ``auxiliary_rates`` and
    #: ``auxiliary_steady_states`` below compute the rates and the steady values of the unknowns
    #: (see ``Fluid``).
    unknowns: ClassVar[tuple[Quantity, ...]] = ()
    #: Names of unknowns that are excluded from the distance from steady sliding, for example
    #: because their steady values are extremely large at the slip rate of a rupture. The criteria
    #: for settled motions and for limit cycles ignore the excluded unknowns.
    excluded_from_distance: ClassVar[tuple[str, ...]] = ()
    #: Names of the quantities in ``quantities_required_by_parts.QUANTITIES_A_PART_MAY_NEED`` that
    #: the rates of the part need. A scene that cannot provide one of the quantities rejects the
    #: part.
    needs: ClassVar[Collection[str]] = frozenset()
    #: Names of the quantities that the functions of the part receive.
    received_quantity_names: ClassVar[frozenset[str]] = frozenset()
    auxiliary_rates: ClassVar[NumericFunction | None] = None
    auxiliary_steady_states: ClassVar[NumericFunction | None] = None
    #: Texts for error messages about a field that belongs to another part: the condition under
    #: which the field does not apply, and a remedy.
    rejection_condition_and_remedy: ClassVar[tuple[str, str]] = ("", "")

    def __init_subclass__(cls) -> None:
        """Reset the derived properties if the subclass changes the equations.

        The derived properties of a part follow from its equations. If a subclass overrides a member
        that defines the equations (``members_defining_equations``), the subclass therefore does not
        inherit the derived properties of its base class.
        """
        super().__init_subclass__()
        copy_former_overrides_to_new_names(cls)
        if cls.members_defining_equations & vars(cls).keys():
            base = next(
                kind for kind in cls.__mro__ if "members_derived_from_equations" in vars(kind)
            )
            for name in cls.members_derived_from_equations:
                if name not in vars(cls):
                    setattr(cls, name, vars(base)[name])

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        """Return the values that the functions of the part read from ``p``.

        The first value is stored at the index of the slot. A law can have any number of values. For
        all other parts, the number of values is limited (see ``parameter_layout``). Numeric fields
        that a subclass declares are appended in the order of their declaration. Override
        ``parameter_values`` only if the functions read values other than the declared fields.

        Parameters
        ----------
        scene : Scene
            Scene that the part belongs to.

        Returns
        -------
        tuple of float
            Values that precede the values of the appended fields. The base class returns an empty
            tuple.
        """
        return ()

    def check(self, scene: SceneView) -> None:
        """Check that the field values are consistent with each other and the scene.

        Parameters
        ----------
        scene : Scene
            Scene that the part belongs to.

        Raises
        ------
        InvalidValue
            If the field values contradict each other or other parts of the scene. The base class
            accepts all values.
        """

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the active physical effects of the part."""
        return ()

    @classmethod
    def list_required_function_names(cls) -> tuple[str, ...]:
        """Return the names of the functions that the part must define.

        Returns
        -------
        tuple of str
            Names of class attributes.
        """
        return ("auxiliary_rates", "auxiliary_steady_states") if cls.unknowns else ()

    @classmethod
    def build_field_rejection_error(cls, field_name: str, value: Any) -> InvalidValue:
        """Return the error for a field that belongs to another part.

        Parameters
        ----------
        field_name : str
            Name of the field.
        value : object
            Value of the field.

        Returns
        -------
        InvalidValue
            Error whose message explains that the field does not apply to this part.
        """
        where, instead = cls.rejection_condition_and_remedy
        rule = f"does not apply {where or f'to {cls.name!r}'}"
        remedy = f"Omit {field_name}, or {instead}." if instead else f"Omit {field_name}."
        return InvalidValue(field_name, value, rule, remedy=remedy)

    def build_field_error(self, field_name: str, rule: str, remedy: str = "") -> InvalidValue:
        """Return the error for an invalid value of a field.

        Parameters
        ----------
        field_name : str
            Name of the field.
        rule : str
            Rule that the value violates.
        remedy : str, optional
            Last sentence of the error message, which suggests a remedy.

        Returns
        -------
        InvalidValue
            Error with the current value of the field.
        """
        return InvalidValue(field_name, getattr(self, field_name), rule, remedy=remedy)


@accept_former_keyword_names
def number(
    default: float | None,
    symbol: str,
    units: str,
    long_name: str,
    scale: str = "",
    *,
    rule: str = "",
    remedy: str = "",
    omit_if_default: bool = False,
) -> Any:
    """Declare a numeric field of a part.

    Parameters
    ----------
    default : float or None
        Default value.
    symbol : str
        Symbol in LaTeX, for tables and figures.
    units : str
        Units, or ``"1"`` for a dimensionless field.
    long_name : str
        Description, for tables, figures and files.
    scale : str, optional
        Scale of a dimensionless field, for example ``"sigma_*"``.
    rule : str, optional
        Name of the condition that values must satisfy. The name is a key of
        ``CONDITION_BY_VALUE_RULE``.
    remedy : str, optional
        Last sentence of the error message if a value violates the rule.
    omit_if_default : bool, default: False
        If True, scenes whose parts lack the field do not list the field, and the default value is
        omitted from the keys of cells and from stored scenes. Use True for every field that is
        added in a later version of rsfstudy, so that existing journals and files stay valid. The
        default value of such a field must never change.

    Returns
    -------
    dataclasses.Field
        Field for the dataclass of the part.

    Raises
    ------
    InvalidValue
        If the rule is unknown.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> from rsfstudy.parts import Law, number
    >>> @dataclass(frozen=True, kw_only=True)
    ... class PowerLaw(Law):
    ...     power: float = number(2.0, "$n$", "1", "power of the slip rate")
    >>> PowerLaw().power
    2.0
    """
    if rule not in CONDITION_BY_VALUE_RULE:
        raise InvalidValue("rule", rule, "is unknown", choices=CONDITION_BY_VALUE_RULE)
    about = {"symbol": symbol, "units": units, "long_name": long_name, "scale": scale}
    metadata = {"about": about, "rule": rule, "remedy": remedy, "omit_if_default": omit_if_default}
    return field(default=default, metadata=metadata)


def flag(default: bool, long_name: str) -> Any:
    """Declare a boolean field of a part.

    Parameters
    ----------
    default : bool
        Default value.
    long_name : str
        Description, for tables, figures and files.

    Returns
    -------
    dataclasses.Field
        Field for the dataclass of the part.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> from rsfstudy.parts import Law, flag
    >>> @dataclass(frozen=True, kw_only=True)
    ... class HealingLaw(Law):
    ...     heals: bool = flag(True, "whether contacts heal at rest")
    >>> HealingLaw().heals
    True
    """
    about = {"symbol": "", "units": "", "long_name": long_name}
    return field(
        default=default, metadata={"about": about, "rule": _BOOLEAN_FIELD_RULE_TEXT, "remedy": ""}
    )


#: Mapping from the text of each validation rule to the function that checks the rule.
CONDITION_BY_VALUE_RULE: Mapping[str, Callable[[float], bool]] = {
    "": lambda value: True,
    POSITIVE: lambda value: value > 0.0,
    NON_NEGATIVE: lambda value: value >= 0.0,
    NON_NEGATIVE_INTEGER: lambda value: value.is_integer() and 0.0 <= value <= 1e5,
    POSITIVE_INTEGER: lambda value: value.is_integer() and 1.0 <= value <= 1e5,
    "must be greater than -1": lambda value: value > -1.0,
    "must be -1 or greater": lambda value: value >= -1.0,
    "must lie between 0 and 1": lambda value: 0.0 <= value <= 1.0,
}


def is_boolean_field(part_class: type[Part], field_name: str) -> bool:
    """Return True if a field of a part is boolean.

    Parameters
    ----------
    part_class : type
        Class of the part.
    field_name : str
        Name of the field.

    Returns
    -------
    bool
        True for fields that ``flag`` declares.
    """
    return bool(
        part_class.__dataclass_fields__[field_name].metadata["rule"] == _BOOLEAN_FIELD_RULE_TEXT
    )


def list_part_field_names(part_class: type[Part]) -> tuple[str, ...]:
    """Return the names of the fields that a part adds to a scene.

    Parameters
    ----------
    part_class : type
        Class of the part.

    Returns
    -------
    tuple of str
        Names of the fields that ``number`` and ``flag`` declare. The field that selects the part
        comes first. Study journals identify computed scenes by their field values in this order, so
        the order must not change.
    """
    names = (f.name for f in fields(part_class) if "about" in f.metadata)
    return tuple(sorted(names, key=lambda name: name != part_class.field_name_that_selects_part))


@cache
def _list_fields_appended_to_parameters(part_class: type[Part]) -> tuple[str, ...]:
    """Return the names of the fields whose values are appended to ``parameter_values``.

    A field is appended if it is numeric and is declared in a subclass of the class that defines
    ``parameter_values``.
    """
    overriding = next(kind for kind in part_class.__mro__ if "parameter_values" in vars(kind))
    known = vars(overriding).get("__dataclass_fields__", {})
    return tuple(
        name
        for name in list_part_field_names(part_class)
        if name not in known and not is_boolean_field(part_class, name)
    )


def collect_parameter_values(part: Part, scene: SceneView) -> FloatTuple:
    """Return the parameter values of a part, followed by the values of the appended fields.

    Parameters
    ----------
    part : Part
        Part of the scene.
    scene : Scene
        Scene that the part belongs to.

    Returns
    -------
    tuple of float
        Parameters of the part. Fields without a value are NaN.
    """
    own = tuple(part.parameter_values(scene))
    appended = _list_fields_appended_to_parameters(type(part))  # type: ignore[arg-type]
    if not appended:
        return own
    values = [getattr(part, name) for name in appended]
    return (*own, *[math.nan if value is None else float(value) for value in values])


def list_part_field_quantities(part_class: type[Part]) -> list[Quantity]:
    """Return the quantities that describe the fields of a part.

    Parameters
    ----------
    part_class : type
        Class of the part.

    Returns
    -------
    list of Quantity
        Quantities with the names, symbols and units of the fields.
    """
    stated = (part_class.__dataclass_fields__[name] for name in list_part_field_names(part_class))
    return [Quantity(f.name, **f.metadata["about"]) for f in stated]


@cache
def _get_field_validation_rule(
    part_class: type[Part], field_name: str
) -> tuple[Any, str, str, Callable[[float], bool] | None]:
    """Return the default of a field, and the rule, remedy and condition for its values."""
    stated = part_class.__dataclass_fields__[field_name]
    rule = stated.metadata["rule"]
    return stated.default, rule, stated.metadata["remedy"], CONDITION_BY_VALUE_RULE.get(rule)


def validate_field_value(part_class: type[Part], field_name: str, value: Any) -> Any:
    """Validate the value of a field and convert it to a Python object.

    Parameters
    ----------
    part_class : type
        Class of the part.
    field_name : str
        Name of the field.
    value : object
        Value to validate.

    Returns
    -------
    float, bool or None
        Valid value. None is valid if the default of the field is None.

    Raises
    ------
    InvalidValue
        If the value has the wrong type, is not finite or violates the rule of the field.
    """
    default, rule, remedy, allows = _get_field_validation_rule(part_class, field_name)  # type: ignore[arg-type]
    if type(value) is float and math.isfinite(value) and allows and allows(value):
        return value  # This shortcut accepts most values.
    if value is None and default is None:
        return None
    flagged = type(value).__name__ == "bool"  # NumPy booleans have the same type name.
    if rule == _BOOLEAN_FIELD_RULE_TEXT:
        if not flagged:
            raise InvalidValue(field_name, value, rule)
        return bool(value)
    if flagged or not isinstance(value, Real):
        remedy = _suggest_number_format(value) if isinstance(value, str) else ""
        raise InvalidValue(field_name, value, "must be a number", remedy=remedy)
    try:
        plain = float(value)
    except OverflowError:
        plain = math.inf
    except TypeError as error:  # Time differences of NumPy are instances of Real.
        raise InvalidValue(field_name, value, "must be a number") from error
    if not math.isfinite(plain):
        raise InvalidValue(field_name, plain, "must be finite")
    if not CONDITION_BY_VALUE_RULE[rule](plain):
        raise InvalidValue(field_name, plain, rule, remedy=remedy)
    return plain


def discover_parts(package_name: str, package_path: Iterable[str]) -> dict[str, type[Part]]:
    """Import the modules of a package and collect their parts.

    Parameters
    ----------
    package_name : str
        Name of the package.
    package_path : iterable of str
        Folders of the package, as in the attribute ``__path__``.

    Returns
    -------
    dict of str to type
        Part classes by name.
    """
    parts: dict[str, type[Part]] = {}
    for file in sorted(module.name for module in pkgutil.iter_modules(package_path)):
        if file.startswith("_"):  # These modules contain shared code.
            continue
        module = importlib.import_module(f"{package_name}.{file}")
        own = [p for p in vars(module).values() if isinstance(p, type) and issubclass(p, Part)]
        parts |= {p.name: p for p in own if p.__module__ == module.__name__}
    return parts


if not TYPE_CHECKING:
    __getattr__ = build_getattr_for_former_names(__name__)


def _suggest_number_format(text: str) -> str:
    """Return a remedy for a string that begins with a digit, but is not a number."""
    if not text.strip()[:1].isdigit():
        return ""
    if ":" in text:
        return "To use several values of a field, declare an axis of a study."
    if "," in text:
        return "Use a decimal point, for example 1.4."
    if " " in text.strip() or any(c.isalpha() for c in text):
        return (
            "To use values with units, define a rig, and create the scene with Rig.scene, or pass "
            "the rig to the study."
        )
    if text.isascii() and text.replace(".", "").isdigit():
        return "Pass a number instead of a string."
    return "Write only the digits 0 to 9 and a decimal point, for example 1.4."
