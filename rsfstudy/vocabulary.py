"""Quantities that scenes, motions and results share: name, symbol, units and long name of each,
for datasets, axis labels and tables. What one measure alone gives is described in its own file.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from types import MappingProxyType

from rsfstudy.quantity import Quantity
from rsfstudy.slider.registry import QUANTITIES as SCENE

_QUANTITIES = (
    # the scene
    *SCENE,
    Quantity("a_over_b_minus_a", "$a/(b-a)$", "1", "direct effect over net rate weakening"),
    Quantity(
        "log_load_velocity_ratio",
        r"$\ln(V_0/V_*)$",
        "1",
        "logarithm of load point velocity over V_star",
    ),
    # the rig
    Quantity("sigma_star", r"$\sigma_*$", "Pa", "normal stress sigma_star"),
    Quantity("slip_distance", "$D_c$", "m", "characteristic slip distance"),
    Quantity("reference_velocity", "$V_*$", "m s-1", "slip rate V_star of the steady state"),
    Quantity("mass", "$m$", "kg m-2", "mass that moves over the area of the fault"),
    Quantity("shear_modulus", "$G$", "Pa", "shear modulus of the medium"),
    Quantity("density", r"$\rho$", "kg m-3", "density of the medium"),
    Quantity("load_velocity", "$V_0$", "m s-1", "load point velocity"),
    # what several measures give, or figures name; files leave out their symbols
    Quantity(
        "critical_velocity_ratio",
        "$V_0/V_*$",
        "1",
        "critical load point velocity for triggered instability",
        "V_*",
    ),
    Quantity(
        "critical_displacement",
        r"$\Delta\delta_0/D_c$",
        "1",
        "critical load point displacement step for triggered instability",
        "D_c",
    ),
    Quantity(
        "critical_normal_stress_step",
        r"$\Delta\sigma/\sigma_*$",
        "1",
        "critical step of imposed normal stress for triggered instability",
        "sigma_*",
    ),
    Quantity(
        "slip_rate_after_step",
        "$V(0^+)/V_*$",
        "1",
        "slip rate just after the step at the boundary",
        "V_*",
    ),
    Quantity(
        "slip_rate_after_closed_form_step",
        "$V(0^+)/V_*$",
        "1",
        "slip rate just after a step of D_c a/(b-a)",
        "V_*",
    ),
    Quantity(
        "critical_stiffness",
        r"$k_{cr}D_c/\sigma_*$",
        "1",
        "critical stiffness of steady sliding",
        "sigma_*/D_c",
    ),
    Quantity(
        "critical_stiffness_from_growth",
        r"$k_{cr}D_c/\sigma_*$",
        "1",
        "stiffness at which small perturbations of the assembled equations neither grow nor decay",
        "sigma_*/D_c",
    ),
    Quantity(
        "critical_stiffness_explicit",
        r"$k_{cr}D_c/\sigma_*$",
        "1",
        "critical stiffness as an explicit function of slip rate",
        "sigma_*/D_c",
    ),
    Quantity(
        "relative_critical_stiffness",
        r"$k_{cr}(V)/k_{cr}(V_*)$",
        "1",
        "critical stiffness over that at V_star",
    ),
    Quantity("steady_friction", r"$\mu_{ss}$", "1", "steady-state friction coefficient"),
    Quantity(
        "recurrence_interval", "$t_r V_*/D_c$", "1", "recurrence interval of stick-slip", "D_c/V_*"
    ),
    Quantity(
        "static_stress_drop",
        r"$\Delta\tau_s/\sigma_*$",
        "1",
        "static stress drop: highest less lowest spring stress of a cycle",
        "sigma_*",
    ),
    Quantity(
        "dynamic_stress_drop",
        r"$\Delta\tau_d/\sigma_*$",
        "1",
        "dynamic stress drop: highest spring stress less that at peak slip rate",
        "sigma_*",
    ),
    Quantity(
        "min_log10_slip_rate",
        r"$\log_{10}(V/V_*)$",
        "1",
        "decimal logarithm of the slowest slip rate over V_star",
    ),
    Quantity(
        "max_log10_slip_rate",
        r"$\log_{10}(V/V_*)$",
        "1",
        "decimal logarithm of the fastest slip rate over V_star",
    ),
    Quantity(
        "peak_log10_slip_rate",
        r"$\log_{10}(V_{peak}/V_*)$",
        "1",
        "decimal logarithm of the slip rate over V_star at each peak",
    ),
    Quantity("slip_per_event", r"$\delta/D_c$", "1", "slip per stick-slip cycle", "D_c"),
    Quantity("residual_friction", r"$\tau/\sigma$", "1", "friction coefficient at peak slip rate"),
    Quantity("phase", "", "1", "fraction of the path along a cycle"),
    Quantity(
        "evolution_distance",
        r"$\delta_e/D_c$",
        "1",
        "slip until 1/e of the stress change after a rate step is left",
        "D_c",
    ),
    # along a motion
    Quantity("time", "$tV_*/D_c$", "1", "time since the step", "D_c/V_*"),
    Quantity("slip", r"$\delta/D_c$", "1", "slip since the step", "D_c"),
    Quantity(
        "log10_slip_rate", r"$\log_{10}(V/V_*)$", "1", "decimal logarithm of slip rate over V_star"
    ),
    Quantity(
        "shear_stress", r"$\tau/\sigma_*$", "1", "shear stress carried by the spring", "sigma_*"
    ),
    Quantity(
        "frictional_stress",
        r"$\tau_f/\sigma_*$",
        "1",
        "frictional resistance: what the spring carries, less what accelerates the mass",
        "sigma_*",
    ),
    Quantity("normal_stress_ratio", r"$\sigma/\sigma_*$", "1", "normal stress", "sigma_*"),
    Quantity(
        "state_variable", r"$\Theta$", "1", "state variable, as a part of the friction coefficient"
    ),
    Quantity("regime", "", "", "equations in use"),
    # reductions
    Quantity(
        "displacement_slope", "", "1", "slope of critical displacement against a/(b-a)", "D_c"
    ),
    Quantity("over_eq_11", "", "1", "critical load point velocity over that of eq. 11"),
    Quantity("over_eq_14", "", "1", "critical displacement step over D_c a/(b-a)"),
    Quantity(
        "implied_norm", r"$VT/(2\pi D_c)$", "1", "instability norm that gives the published value"
    ),
    Quantity(
        "lattice_boundary",
        "$V_0/V_*$",
        "1",
        "boundary between stable and unstable cells",
        "V_*",
    ),
    Quantity(
        "lowering", "", "1", "fraction by which the boundary lies below that of the reference"
    ),
    Quantity(
        "stabilising_velocity",
        "$V_0/V_*$",
        "1",
        "load point velocity beyond which a spring of that stiffness slides stably",
        "V_*",
    ),
    Quantity("stiffness_slope", "", "1", "slope of critical stiffness against ln V", "sigma_*/D_c"),
    Quantity(
        "peak_lowering",
        "",
        "1",
        "decimal logarithm of the peak slip rate with mass, less that without",
    ),
    Quantity(
        "separation",
        "",
        "1",
        "spread of the stress left after a slip of D_c by downward steps of 2 to 4 decades",
        "sigma_*",
    ),
    Quantity("slowing", "", "1", "fraction by which the evolution is shorter than the other"),
    Quantity("proportionality", "", "1", "slope of achieved against requested digits"),
    Quantity("zeta", r"$\zeta$", "1", "slope of V_0/V_star - 1 against a/(b-a)"),
    Quantity("static_slope", "", "1", "slope of static stress drop against ln V_0", "sigma_*"),
    Quantity("dynamic_slope", "", "1", "slope of dynamic stress drop against ln V_0", "sigma_*"),
    *(
        Quantity(
            f"{drop}_slope_{range_}",
            "",
            "1",
            f"slope of {drop} stress drop against ln V_0 {words}",
            "sigma_*",
        )
        for drop in ("static", "dynamic")
        for range_, words in (
            ("slow", "from V_star to 10 V_star"),
            ("fast", "from 100 to 1000 V_star"),
        )
    ),
    Quantity(
        "static_slope_scaled", "$f(k)$", "1", "slope of static stress drop over (a-b) sigma_star"
    ),
    Quantity("dynamic_slope_scaled", "", "1", "slope of dynamic stress drop over (a-b) sigma_star"),
    # what effects cost
    Quantity("drop_lost_without_mass", "", "1", "fraction of the static drop lost, against mass"),
    Quantity(
        "drop_lost_without_coupling",
        "",
        "1",
        "fraction of the static drop lost, against inclined driving with alpha",
    ),
    Quantity("work_saved", "", "1", "fraction of the right-hand sides per cycle saved"),
    # checks of accuracy
    Quantity("ended_as", "", "1", "status the measure ended with, as its flag value"),
    Quantity("requested_digits", "", "1", "decimal digits asked for: -log10(rtol)"),
    # every lattice
    Quantity("status", "", "", "outcome of the cell"),
    Quantity("rhs_evaluations", "", "1", "right-hand sides evaluated"),
    Quantity("wall_time", "", "s", "wall time of the cell"),
    Quantity("message", "", "", "what the cell says of its outcome"),
)

QUANTITIES: dict[str, Quantity] = {quantity.name: quantity for quantity in _QUANTITIES}

_SUFFIXES = {
    "error": "numerical error estimate of",
    "stable": "value verified as stable beside",
    "unstable": "value verified as unstable beside",
    "stderr": "standard error (misfit of the fitted law) of",
    "misfit": "largest misfit of the law fitted for",
    "points": "number of points fitted for",
    "crossings": "changes of the answer along",
    "closed_form": "published closed form beside",
}

_COUNTS = ("points", "crossings")

#: Times that were measured: no two runs share them.
MEASURED_TIMES = (
    "wall_time",
    "run_time",
    "relative_time",
    "cheapest_default_time",
    "evaluation_cost",
    "evaluation_cost_in_rupture",
    "time_per_evaluation",
    "time_per_evaluation_in_rupture",
)

#: Coordinates that follow from an axis: name -> (axis, formula).
DERIVED: dict[str, tuple[str, Callable[[float], float]]] = {
    "log_load_velocity_ratio": (
        "load_velocity_ratio",
        lambda ratio: -math.inf if ratio == 0.0 else math.log(ratio),
    ),
    "a_over_b_minus_a": (
        "b_over_a",
        lambda b_over_a: math.inf if b_over_a == 1.0 else 1.0 / (b_over_a - 1.0),
    ),
}


def coverage(name: str) -> str:
    """Kind of content of a variable, in the words of ISO 19115-1."""
    if name in ("rhs_evaluations", *MEASURED_TIMES):
        return "auxiliaryInformation"
    if name in ("status", "message") or re.search("_(error|stderr|misfit|points)$", name):
        return "qualityInformation"
    return "modelResult"


def quantity(name: str, own: Mapping[str, Quantity] = MappingProxyType({})) -> Quantity:
    """Look a quantity up, deriving ``<name>_error`` and its like from ``<name>``.

    Names that neither `own` nor the vocabulary holds describe themselves.

    Parameters
    ----------
    name : str
    own : mapping of str to Quantity
        What a study says of its own numbers.
    """
    if name in own:
        return own[name]
    if name in QUANTITIES:
        return QUANTITIES[name]
    match = re.fullmatch(rf"(\w+)_({'|'.join(_SUFFIXES)})", name)
    if match:
        of = quantity(match[1], own)
        units = "1" if match[2] in _COUNTS else of.units
        scale = "" if match[2] in _COUNTS else of.scale
        return Quantity(name, of.symbol, units, f"{_SUFFIXES[match[2]]} {of.long_name}", scale)
    return Quantity(name, "", "1", name.replace("_", " "))
