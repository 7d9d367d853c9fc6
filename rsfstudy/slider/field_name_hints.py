"""Functions that suggest corrections for unknown field names and law names of a scene.

The module maps common synonyms to the names that rsfstudy uses.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

_STIFFNESS_FIELD_NAME_HINT = (
    "stiffness_ratio (stiffness divided by the critical stiffness) or stiffness (k "
    "D_c/sigma_*, or a value with units if you use a rig, for example '0.05 MPa/um')"
)
_INERTIA_FIELD_NAME_HINT = (
    "Write inertia=True, and pass the period of free oscillation in s as period. Alternatively, "
    "create the scene from a rig."
)
_LOAD_VELOCITY_FIELD_NAME_HINT = (
    "Use load_velocity_ratio, which is V_0/V_*. With a rig, use load_velocity with units."
)
_SIMULATION_DURATION_HINT = "Pass the duration to rsfstudy.simulate(scene, duration=...)."


def _hint_for_rig_quantity(symbol: str, rig_quantity_name: str) -> str:
    """Return an error hint for a rig quantity that is not a scene field."""
    return (
        f"{symbol} is the rig parameter {rig_quantity_name}. Pass it as "
        f"Rig({rig_quantity_name}=...). In a study with a rig, {rig_quantity_name} can also be an "
        "axis or an override."
    )


def _map_names_to_same_value(space_separated_names: str, value: str) -> dict[str, str]:
    return dict.fromkeys(space_separated_names.split(), value)


#: Error hints for field names that users may expect but scenes do not have.
_HINT_BY_WRONG_FIELD_NAME: Mapping[str, str] = {
    **_map_names_to_same_value("k K kappa spring_constant", f"Write {_STIFFNESS_FIELD_NAME_HINT}."),
    **_map_names_to_same_value("b B", "Use b_over_a, which is b/a."),
    **_map_names_to_same_value("a_minus_b b_minus_a ab", "Write a and b_over_a, which is b/a."),
    **_map_names_to_same_value("A", "Write a."),
    **_map_names_to_same_value(
        "Dc dc D_c d_c DC L dcrit slip_distance", _hint_for_rig_quantity("D_c", "slip_distance")
    ),
    **_map_names_to_same_value("mu mu0 mu_0 mu_ref f0 f_0", "Write mu_star."),
    **_map_names_to_same_value(
        "sigma sigma_n sigman sigma0 sigma_star sn",
        _hint_for_rig_quantity("sigma_*", "normal_stress"),
    ),
    **_map_names_to_same_value(
        "V0 V_0 v0 v_0 V v Vl vl vlp Vlp velocity load_velocity", _LOAD_VELOCITY_FIELD_NAME_HINT
    ),
    **_map_names_to_same_value(
        "V_star v_star vstar Vref vref V_ref v_ref reference_velocity",
        _hint_for_rig_quantity("V_*", "reference_velocity"),
    ),
    **_map_names_to_same_value("G shear_modulus", _hint_for_rig_quantity("G", "shear_modulus")),
    **_map_names_to_same_value("rho density", _hint_for_rig_quantity("rho", "density")),
    **_map_names_to_same_value(
        "kc k_c kcr k_cr k_ratio k_over_kc k_kc", "Write stiffness_ratio, which is k/k_cr."
    ),
    **_map_names_to_same_value(
        "tau tau0 tau_0",
        "Write initial_stress, which is the difference from steady sliding divided by sigma_*.",
    ),
    **_map_names_to_same_value(
        "theta theta0 theta_0", "Write initial_state, which is b ln(theta/theta_*)."
    ),
    **_map_names_to_same_value("m M mass", _INERTIA_FIELD_NAME_HINT),
    **_map_names_to_same_value("eta damping", "Write radiation_damping, which is eta V_*/sigma_*."),
    **_map_names_to_same_value("T", "Write period, in s."),
    **_map_names_to_same_value("evolution evolution_law state_law friction_law", "Write law."),
    **_map_names_to_same_value("duration t_end tmax", _SIMULATION_DURATION_HINT),
}
#: Mapping from synonyms of laws to the names that rsfstudy uses.
_LAW_NAME_BY_ALIAS: Mapping[str, str] = {
    **_map_names_to_same_value(
        "aging ageing dieterich dieterich_ruina dr aging_law ageing_law", "slowness"
    ),
    **_map_names_to_same_value("slowness_law", "slowness"),
    **_map_names_to_same_value("ruina ruina_dieterich rr slip_law", "slip"),
    **_map_names_to_same_value("prz perrin", "perrin_rice_zheng"),
    **_map_names_to_same_value("kato_tullis kato", "composite"),
    **_map_names_to_same_value("okubo cutoff", "cut_off"),
}


def hint_for_unknown_field(field_name: str) -> str:
    """Return an error hint for an unknown field name.

    Parameters
    ----------
    field_name : str
        Name that the user passed.

    Returns
    -------
    str
        Hint for the error message. The string is empty if there is no hint.
    """
    return _HINT_BY_WRONG_FIELD_NAME.get(field_name, "")


def replace_law_alias_by_law_name(law_name_or_alias: str) -> str:
    """Return the name of a law for one of its synonyms.

    Parameters
    ----------
    law_name_or_alias : str
        Name or synonym of a law.

    Returns
    -------
    str
        Name of the law. An unknown name is returned unchanged.
    """
    return _LAW_NAME_BY_ALIAS.get(
        _normalise_case_and_separators(law_name_or_alias), law_name_or_alias
    )


def _normalise_case_and_separators(part_name: str) -> str:
    return part_name.strip().lower().replace("-", "_").replace(" ", "_")


def hint_for_unknown_part_name(slot_name: str, value: Any, valid_part_names: Iterable[str]) -> str:
    """Return an error hint for an unknown value of a field such as ``law``.

    Parameters
    ----------
    slot_name : str
        Name of the slot, for example ``law``.
    value : object
        Value that the user passed.
    valid_part_names : iterable of str
        Valid choices of the slot.

    Returns
    -------
    str
        Hint for the error message. The string is empty if there is no hint.
    """
    if slot_name == "normal_stress" and re.match(r"[\d.]", str(value)):
        return (
            "The field normal_stress selects a model of normal stress. To set the value of the "
            "normal stress, pass Rig(normal_stress=...). In a study with a rig, an axis or an "
            "override named normal_stress can also set the value."
        )
    if not isinstance(value, str):
        return ""
    plain = _normalise_case_and_separators(value)
    if slot_name == "law" and plain == "nagata":
        return "Write stress_dependence=..., which can be combined with any law."
    return f"Write {slot_name}={plain!r}." if plain in valid_part_names else ""


def hint_for_positional_argument(
    value: Any, part_names_by_slot_name: Mapping[str, Iterable[str]]
) -> str:
    """Return an error hint for a positional argument of ``Scene``.

    Parameters
    ----------
    value : object
        Value that the user passed without a field name.
    part_names_by_slot_name : mapping of str to iterable of str
        Valid choices of each slot.

    Returns
    -------
    str
        Hint for the error message.
    """
    for slot, choices in part_names_by_slot_name.items() if isinstance(value, str) else ():
        found = hint_for_unknown_part_name(slot, value, choices)
        if found:
            return found
    if isinstance(value, Mapping):
        return "To pass a mapping, unpack it with **, for example Scene(**fields)."
    return "Write, for example, Scene(law='slowness', stiffness_ratio=0.8)."
