"""Functions that check if a scene provides the quantities that its parts need.

The attribute ``received_quantity_names`` of a part lists the quantities that are passed to its
functions. If effective normal stress is constant, shear stress can be computed from the friction
coefficient and the normal stress. A part can list additional required quantities in its ``needs``
attribute. If a required quantity is unavailable, the scene rejects the part. Otherwise, the part
would compute its rates from wrong values.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.scene_view import SceneView

if TYPE_CHECKING:
    from rsfstudy.slider.parts import Part

SLIP_RATE, STATE, FRICTION_COEFFICIENT = "slip_rate", "state", "friction_coefficient"
SHEAR_STRESS, NORMAL_STRESS = "shear_stress", "normal_stress"
PORE_PRESSURE, EFFECTIVE_NORMAL_STRESS = "pore_pressure", "effective_normal_stress"

#: Names and descriptions of the quantities that a part may list in ``needs``.
QUANTITIES_A_PART_MAY_NEED: Mapping[str, str] = {
    SLIP_RATE: "ln(V/V_*)",
    STATE: "the states of the law",
    FRICTION_COEFFICIENT: "friction coefficient tau/sigma = mu_* + a ln(V/V_*) + sum of the states",
    SHEAR_STRESS: "frictional shear stress tau over sigma_*",
    NORMAL_STRESS: "normal stress over sigma_*",
    PORE_PRESSURE: "pore pressure minus the pressure of the surroundings, over sigma_*",
    EFFECTIVE_NORMAL_STRESS: "normal stress minus pore pressure, over sigma_*",
}
#: Quantities that the functions of a law receive. The friction coefficient is computed from the
#: slip rate and the state.
QUANTITIES_RECEIVED_BY_LAWS = frozenset({SLIP_RATE, STATE, FRICTION_COEFFICIENT})
#: Quantities that can be computed from other quantities. The value of each key is the set of
#: quantities that the formula for the key contains.
_QUANTITIES_COMPUTED_FROM_OTHERS: Mapping[str, frozenset[str]] = {
    EFFECTIVE_NORMAL_STRESS: frozenset({NORMAL_STRESS, PORE_PRESSURE}),
    SHEAR_STRESS: frozenset({FRICTION_COEFFICIENT, NORMAL_STRESS, PORE_PRESSURE}),
}


def check_names_of_needed_quantities(slot_name: str, part_class: type[Part]) -> None:
    """Raise ``InvalidValue`` if the ``needs`` attribute of a part is invalid.

    The ``needs`` attribute must be a set of names of known quantities.

    Parameters
    ----------
    slot_name : str
        Name of the slot.
    part_class : type
        Class of the part.

    Raises
    ------
    InvalidValue
        If ``needs`` is a string or contains an unknown quantity.
    """
    needs: Any = part_class.needs
    if isinstance(needs, str):
        raise InvalidValue("needs", needs, "must be a set of names", remedy=f"Write {{{needs!r}}}.")
    for name in needs:
        if name not in QUANTITIES_A_PART_MAY_NEED:
            rule = f"is not a quantity that rates of the {slot_name} {part_class.name} can need"
            raise InvalidValue("needs", name, rule, choices=QUANTITIES_A_PART_MAY_NEED)


def check_needed_quantities(scene: SceneView) -> None:
    """Raise ``InvalidValue`` if a scene lacks a quantity that a part needs.

    Parameters
    ----------
    scene : Scene
        Scene to check.

    Raises
    ------
    InvalidValue
        If the functions of a part do not receive a needed quantity.
    """
    for slot, part in zip(scene.parts._fields, scene.parts, strict=True):
        missing = (
            sorted(set(part.needs) - find_quantities_known_to_part(scene, part))
            if part.needs
            else []
        )
        if missing:
            raise _build_missing_quantities_error(scene, slot, part, missing)


def find_quantities_known_to_part(scene: SceneView, part: Part) -> frozenset[str]:
    """Return the quantities that are available to the functions of a part.

    The result contains the quantities passed to the functions, the quantities that are constant in
    the scene, and the quantities that can be computed from these two groups.

    Parameters
    ----------
    scene : Scene
        Scene that the part belongs to.
    part : Part
        Part of the scene.

    Returns
    -------
    frozenset of str
        Names of quantities in ``QUANTITIES_A_PART_MAY_NEED``.
    """
    constant = {NORMAL_STRESS, PORE_PRESSURE} - {
        change.unknown_quantity_name for change in _find_causes_of_unknown_quantities(scene)
    }
    found = constant | part.received_quantity_names
    if part is scene.parts.law and _find_causes_of_unknown_friction(scene):
        found -= {FRICTION_COEFFICIENT}
    return frozenset(
        found | {name for name, terms in _QUANTITIES_COMPUTED_FROM_OTHERS.items() if found >= terms}
    )


class _CauseOfUnknownQuantity(NamedTuple):
    """Reason why a quantity is unavailable in a scene, and how to make it available."""

    unknown_quantity_name: str
    cause_text: str
    remedy: str


def _find_causes_of_unknown_quantities(scene: SceneView) -> list[_CauseOfUnknownQuantity]:
    """Return the reasons why quantities are unavailable in a scene."""
    parts, found = scene.parts, []
    if parts.normal_stress.normal_stress is not None:
        cause = f"normal_stress={parts.normal_stress.name!r}"
        found.append(_CauseOfUnknownQuantity(NORMAL_STRESS, cause, "set normal_stress='constant'"))
    if scene.changes_normal_stress:
        cause = f"the loading {parts.loading.name!r}"
        remedy = "remove normal stress and pore pressure from the loading"
        found += [
            _CauseOfUnknownQuantity(name, cause, remedy) for name in (NORMAL_STRESS, PORE_PRESSURE)
        ]
    if parts.fluid.unknowns:
        cause = f"fluid={parts.fluid.name!r}"
        found.append(_CauseOfUnknownQuantity(PORE_PRESSURE, cause, "set fluid='drained'"))
    return found + _find_causes_of_unknown_friction(scene)


def _find_causes_of_unknown_friction(scene: SceneView) -> list[_CauseOfUnknownQuantity]:
    """Return the reasons why a law cannot compute the friction coefficient.

    The friction coefficient for forward slip is not valid if slip reverses. If friction depends on
    temperature, the state that a law receives includes part of the temperature effect.
    """
    causes, temperature = [], scene.parts.temperature
    if scene.parts.law.regularised:
        causes.append(("regularised=True", "set regularised=False"))
    if any(temperature.dimensionless_activation_energies):
        cause = f"temperature={temperature.name!r}"
        causes.append((cause, "remove the activation terms"))
    return [_CauseOfUnknownQuantity(FRICTION_COEFFICIENT, *texts) for texts in causes]


def _build_missing_quantities_error(
    scene: SceneView, slot_name: str, part: Part, missing_quantity_names: list[str]
) -> InvalidValue:
    """Return the error for a part that needs an unavailable quantity."""
    known = find_quantities_known_to_part(scene, part)
    # Determine the missing quantities, and the fields of the scene that make them unavailable.
    wanted = (
        set[str]().union(
            *(_QUANTITIES_COMPUTED_FROM_OTHERS.get(name, {name}) for name in missing_quantity_names)
        )
        - known
    )
    changes = [
        change
        for change in _find_causes_of_unknown_quantities(scene)
        if change.unknown_quantity_name in wanted
    ]
    causes = "with " + " and ".join(dict.fromkeys(change.cause_text for change in changes))
    remedies = ", ".join(dict.fromkeys(change.remedy for change in changes))
    if wanted > {change.unknown_quantity_name for change in changes}:
        causes, remedies = "in any scene", "write the unknown as a state of a law"
    named = " and ".join(missing_quantity_names)
    rule = (
        f"requires {named}, but its rates do not receive {named} {causes}. The available "
        "quantities are "
    )
    rule += ", ".join(sorted(known)) or "no quantity"
    remedy = f"{remedies[:1].upper()}{remedies[1:]}, or use a part that does not need {named}."
    return InvalidValue(slot_name, part.name, rule, remedy=remedy)
