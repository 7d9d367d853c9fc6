"""Synonyms: names that others give to the fields of a scene and its laws."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

_STIFFNESS_HINT = (
    "stiffness_ratio (over the critical stiffness) or stiffness (k D_c/sigma_*; of a rig with "
    "units, as in '0.05 MPa/um')"
)
_INERTIA_HINT = (
    "Write inertia=True, and period for its period of free oscillation in s; or state the rig."
)
_LOAD_VELOCITY_HINT = (
    "Write load_velocity_ratio, which is V_0/V_*; of a rig load_velocity with units."
)
_DURATION_HINT = "It belongs to rsfstudy.simulate(scene, duration=...)."


def _rig_quantity_hint(symbol: str, name: str) -> str:
    """The remedy for a quantity of a rig."""
    return (
        f"{symbol} is {name} of a rig: Rig({name}=...), or an axis or another value of a "
        "study that has one."
    )


def _map_names(names: str, remedy: str) -> dict[str, str]:
    return dict.fromkeys(names.split(), remedy)


#: What to do instead of stating a field by another name.
_FIELD_HINTS: Mapping[str, str] = {
    **_map_names("k K kappa spring_constant", f"Write {_STIFFNESS_HINT}."),
    **_map_names("b B", "Write b_over_a, which is b/a."),
    **_map_names("a_minus_b b_minus_a ab", "Write b_over_a, which is b/a, beside a."),
    **_map_names("A", "Write a."),
    **_map_names(
        "Dc dc D_c d_c DC L dcrit slip_distance", _rig_quantity_hint("D_c", "slip_distance")
    ),
    **_map_names("mu mu0 mu_0 mu_ref f0 f_0", "Write mu_star."),
    **_map_names(
        "sigma sigma_n sigman sigma0 sigma_star sn", _rig_quantity_hint("sigma_*", "normal_stress")
    ),
    **_map_names("V0 V_0 v0 v_0 V v Vl vl vlp Vlp velocity load_velocity", _LOAD_VELOCITY_HINT),
    **_map_names(
        "V_star v_star vstar Vref vref V_ref v_ref reference_velocity",
        _rig_quantity_hint("V_*", "reference_velocity"),
    ),
    **_map_names("G shear_modulus", _rig_quantity_hint("G", "shear_modulus")),
    **_map_names("rho density", _rig_quantity_hint("rho", "density")),
    **_map_names(
        "kc k_c kcr k_cr k_ratio k_over_kc k_kc", "Write stiffness_ratio, which is k/k_cr."
    ),
    **_map_names(
        "tau tau0 tau_0", "Write initial_stress, over sigma_*, above that of steady sliding."
    ),
    **_map_names("theta theta0 theta_0", "Write initial_state, which is b ln(theta/theta_*)."),
    **_map_names("m M mass", _INERTIA_HINT),
    **_map_names("eta damping", "Write radiation_damping: eta V_*/sigma_*."),
    **_map_names("T", "Write period, in s."),
    **_map_names("evolution evolution_law state_law friction_law", "Write law."),
    **_map_names("duration t_end tmax", _DURATION_HINT),
}
#: Laws by their other names.
_LAW_ALIASES: Mapping[str, str] = {
    **_map_names("aging ageing dieterich dieterich_ruina dr aging_law ageing_law", "slowness"),
    **_map_names("slowness_law", "slowness"),
    **_map_names("ruina ruina_dieterich rr slip_law", "slip"),
    **_map_names("prz perrin", "perrin_rice_zheng"),
    **_map_names("kato_tullis kato", "composite"),
    **_map_names("okubo cutoff", "cut_off"),
}


def suggest_field(name: str) -> str:
    """Remedy for a field of this name; empty where nobody knows."""
    return _FIELD_HINTS.get(name, "")


def canonical_law_name(value: str) -> str:
    """The name of a law here, where others call it by this one; else the value itself."""
    return _LAW_ALIASES.get(_normalise_name(value), value)


def _normalise_name(value: str) -> str:
    return value.strip().lower().replace("-", "_").replace(" ", "_")


def suggest_choice(slot: str, value: Any, choices: Iterable[str]) -> str:
    """Remedy for this choice in a slot; empty where nobody knows."""
    if slot == "normal_stress" and re.match(r"[\d.]", str(value)):
        return _rig_quantity_hint("sigma_*", slot)
    if not isinstance(value, str):
        return ""
    plain = _normalise_name(value)
    if slot == "law" and plain == "nagata":
        return "Write stress_dependence=..., beside any law."
    return f"Write {slot}={plain!r}." if plain in choices else ""


def suggest_keyword(value: Any, slots: Mapping[str, Iterable[str]]) -> str:
    """Remedy for a value that was given to a scene without a name."""
    for slot, choices in slots.items() if isinstance(value, str) else ():
        found = suggest_choice(slot, value, choices)
        if found:
            return found
    if isinstance(value, Mapping):
        return "Write Scene(**fields)."
    return "Name the field, as in Scene(law='slowness', stiffness_ratio=0.8)."
