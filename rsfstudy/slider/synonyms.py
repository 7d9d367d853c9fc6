"""Synonyms: names that others give to the fields of a scene and its laws."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

_SPRING = (
    "stiffness_ratio (over the critical stiffness) or stiffness (k D_c/sigma_*; of a rig with "
    "units, as in '0.05 MPa/um')"
)
_MASS = "Write inertia=True, and period for its period of free oscillation in s; or state the rig."
_LOADING = "Write load_velocity_ratio, which is V_0/V_*; of a rig load_velocity with units."
_OF_SIMULATE = "It belongs to rsfstudy.simulate(scene, duration=...)."


def _of_rig(symbol: str, name: str) -> str:
    """The remedy for a quantity of a rig."""
    return (
        f"{symbol} is {name} of a rig: Laboratory({name}=...), or an axis or another value of a "
        "study that has one."
    )


def _each(names: str, remedy: str) -> dict[str, str]:
    return dict.fromkeys(names.split(), remedy)


#: What to do instead of stating a field by another name.
_FIELDS: Mapping[str, str] = {
    **_each("k K kappa spring_constant", f"Write {_SPRING}."),
    **_each("b B", "Write b_over_a, which is b/a."),
    **_each("a_minus_b b_minus_a ab", "Write b_over_a, which is b/a, beside a."),
    **_each("A", "Write a."),
    **_each("Dc dc D_c d_c DC L dcrit slip_distance", _of_rig("D_c", "slip_distance")),
    **_each("mu mu0 mu_0 mu_ref f0 f_0", "Write mu_star."),
    **_each("sigma sigma_n sigman sigma0 sigma_star sn", _of_rig("sigma_*", "normal_stress")),
    **_each("V0 V_0 v0 v_0 V v Vl vl vlp Vlp velocity load_velocity", _LOADING),
    **_each(
        "V_star v_star vstar Vref vref V_ref v_ref reference_velocity",
        _of_rig("V_*", "reference_velocity"),
    ),
    **_each("G shear_modulus", _of_rig("G", "shear_modulus")),
    **_each("rho density", _of_rig("rho", "density")),
    **_each("kc k_c kcr k_cr k_ratio k_over_kc k_kc", "Write stiffness_ratio, which is k/k_cr."),
    **_each("tau tau0 tau_0", "Write initial_stress, over sigma_*, above that of steady sliding."),
    **_each("theta theta0 theta_0", "Write initial_state, which is b ln(theta/theta_*)."),
    **_each("m M mass", _MASS),
    **_each("eta damping", "Write radiation_damping: eta V_*/sigma_*."),
    **_each("T", "Write period, in s."),
    **_each("evolution evolution_law state_law friction_law", "Write law."),
    **_each("duration t_end tmax", _OF_SIMULATE),
}
#: Laws by their other names.
_LAWS: Mapping[str, str] = {
    **_each("aging ageing dieterich dieterich_ruina dr aging_law ageing_law", "slowness"),
    **_each("slowness_law", "slowness"),
    **_each("ruina ruina_dieterich rr slip_law", "slip"),
    **_each("prz perrin", "perrin_rice_zheng"),
    **_each("kato_tullis kato", "composite"),
    **_each("okubo cutoff", "cut_off"),
}


def instead_of_field(name: str) -> str:
    """Remedy for a field of this name; empty where nobody knows."""
    return _FIELDS.get(name, "")


def law_name(value: str) -> str:
    """The name of a law here, where others call it by this one; else the value itself."""
    return _LAWS.get(_plain(value), value)


def _plain(value: str) -> str:
    return value.strip().lower().replace("-", "_").replace(" ", "_")


def instead_of_choice(slot: str, value: Any, choices: Iterable[str]) -> str:
    """Remedy for this choice in a slot; empty where nobody knows."""
    if slot == "normal_stress" and re.match(r"[\d.]", str(value)):
        return _of_rig("sigma_*", slot)
    if not isinstance(value, str):
        return ""
    plain = _plain(value)
    if slot == "law" and plain == "nagata":
        return "Write stress_dependence=..., beside any law."
    return f"Write {slot}={plain!r}." if plain in choices else ""


def instead_of_unnamed(value: Any, slots: Mapping[str, Iterable[str]]) -> str:
    """Remedy for a value that was given to a scene without a name."""
    for slot, choices in slots.items() if isinstance(value, str) else ():
        found = instead_of_choice(slot, value, choices)
        if found:
            return found
    if isinstance(value, Mapping):
        return "Write Scene(**fields)."
    return "Name the field, as in Scene(law='slowness', stiffness_ratio=0.8)."
