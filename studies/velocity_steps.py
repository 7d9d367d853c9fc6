"""Velocity steps: by how much a, b, a - b and D_c as read off lie, against stiffness.

Load point velocity steps from V_* to r V_*, and friction is recorded over 20 D_c. Read off are the
direct effect, the evolution after it and the displacement over which it falls to 1/e. The softer
the machine, the smaller a and b: at 10 k_cr tenfold steps give an a that is 14 to 40 % too small. a
- b is right wherever friction has settled. D_c lies by the machine and, with the slowness law, by
the direction of the step, which no correction for stiffness mends. With the slip law, large steps
up on soft machines end in instability.
"""

import math

import xarray as xr
from scipy.integrate import quad

from rsfstudy import Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.measures import VelocityStep
from rsfstudy.reductions import ClosedFormRatio
from rsfstudy.study.figure_declarations import horizontal_line

#: Stiffness over critical stiffness, compliant to stiff.
STIFFNESS_RATIOS = [1.2, 1.5, 2.0, 3.0, 5.0, 10.0, 30.0, 100.0, 300.0]
STEPS = [0.01, 0.1, 10.0, 100.0]
STIFFEST = STIFFNESS_RATIOS[-1]

base = Scene(normal_stress="constant", b_over_a=2.0, velocity_steps=1)
a, b = base.a, base.b
STEP_DESCRIPTIONS = {0.01: "down by 100", 0.1: "down by 10", 10.0: "up by 10", 100.0: "up by 100"}


def peak_departure(law: str, ratio: float) -> float:
    """Departure of friction at its peak from that of a rigid slider, to first order in a/K, in
    units of b a/K: what does not evolve while slip speeds up, and the direct effect of the slip
    that is faster than the load point while friction falls.
    """
    rate = math.log(ratio)
    if law == "slowness":
        return rate / ratio + 1.0 - 1.0 / ratio
    return float(quad(lambda y: y / math.expm1(y) if y else 1.0, 0.0, rate)[0]) + rate


def rigid_limit_claim(law: str, ratio: float) -> Claim:
    """P6: a stiff slider."""
    forms = {
        "slip": "dmu = a ln r - b ln r [1 - exp(-delta/D_c)]",
        "slowness": "dmu = (a - b) ln r + b ln[1 + (r - 1) exp(-delta/D_c)]",
    }
    expected = b * abs(peak_departure(law, ratio)) * a / (STIFFEST * (b - a))
    return Claim(
        id="P6",
        statement=f"{law} law, {STEP_DESCRIPTIONS[ratio]}, k = {STIFFEST:g} k_cr: a rigid "
        "slider's but for O(a/K)",
        source=f"closed form: {forms[law]}, and its first order in a/K",
        variable="closed_form_departure",
        where={"law": law, "velocity_ratio": ratio, "stiffness_ratio": STIFFEST},
        published=expected,
        tolerance=(0.1 if law == "slip" else 0.01) * expected,
        reason="second order, in (a/K)(b - a)/a = 1/300: three times that by the slowness law, and "
        "thirty times by the slip law, whose evolution is steeper by ln r and more",
    )


def direct_effect_claim(law: str, ratio: float) -> Claim:
    """P7: the direct effect of a machine that is ten times as stiff as critical."""
    return Claim.below(
        id="P7",
        statement=f"{law} law, {STEP_DESCRIPTIONS[ratio]}, k = 10 k_cr: a is read at least a "
        "tenth too small",
        source="evolution begins before the spring has loaded the slider",
        variable="apparent_a",
        where={"law": law, "velocity_ratio": ratio, "stiffness_ratio": 10.0},
        published=0.9 * a,
    )


def rate_dependence_claim(law: str, ratio: float) -> Claim:
    """P8: a - b does not depend on the machine."""
    return Claim(
        id="P8",
        statement=f"{law} law, {STEP_DESCRIPTIONS[ratio]}, k = 3 k_cr: a - b is read right",
        source="steady friction: (a - b) ln r at every stiffness",
        variable="apparent_a_minus_b",
        where={"law": law, "velocity_ratio": ratio, "stiffness_ratio": 3.0},
        published=a - b,
        tolerance=5e-8 * a,
        reason="oscillations die as exp[-(k^ - 1)/2] a D_c: exp(-20) is left; and half of the "
        "accuracy asked for",
    )


def slip_distance_claim(ratio: float) -> Claim:
    """P9: 1/e of a slowness-law evolution is not left after D_c."""
    left = math.log((ratio - 1.0) / (ratio ** (1.0 / math.e) - 1.0))
    return Claim(
        id="P9",
        statement=f"slowness law, {STEP_DESCRIPTIONS[ratio]}, k = {STIFFEST:g} k_cr: D_c by "
        f"1/e is {left:.3f} D_c",
        source="closed form: ln{(r - 1)/[r^(1/e) - 1]}",
        variable="corrected_slip_distance",
        where={"law": "slowness", "velocity_ratio": ratio, "stiffness_ratio": STIFFEST},
        published=left,
        tolerance=0.02,
        reason="(a/K) ln(K/a) of slip comes before the peak, from which it is counted",
    )


#: Load point displacement that is shown of the records, in D_c.
PLOTTED_DISPLACEMENT = 8.0


def smallest_steps(ratios: list[float]) -> list[float]:
    """The step down and the step up that are closest to none."""
    down, up = [r for r in ratios if r < 1.0], [r for r in ratios if r > 1.0]
    return [*([min(up)] if up else []), *([max(down)] if down else [])]


def friction_change(row: xr.Dataset) -> xr.DataArray:
    """Change of friction, as far as it is shown."""
    change = (row["friction_coefficient"] - row["friction_before"]) / row["a"]
    return change.where(row["load_point_displacement"] <= PLOTTED_DISPLACEMENT)


def reading_panel(
    title: str, label: str, name: str, over: tuple[str, ...] = (), alike: str = ""
) -> Panel:
    """A number as read off over the product of some of the scene's own, against stiffness."""
    return Panel(
        x="stiffness_ratio",
        y=lambda row: row[name] / math.prod(float(row[factor]) for factor in over),
        hue=["velocity_ratio", "law"],
        style={"linewidth": 0.9},
        overlays=[horizontal_line(1.0)],
        title=title,
        y_label=label,
        log="x",
        y_scale_group=alike,
    )


LENGTH_LABEL = "$D_{read}/D_c$"
figure = Figure(
    [
        Panel(
            x="load_point_displacement",
            y=friction_change,
            hue=["stiffness_ratio", "velocity_ratio"],
            facet=["law"],
            isel={"velocity_ratio": smallest_steps, "stiffness_ratio": slice(None, None, 2)},
            style={"marker": ""},
            y_label=r"Change of friction, $\Delta\mu/a$",
            x_limits=(-0.3, PLOTTED_DISPLACEMENT),
            y_scale_group="records",
        ),
        reading_panel("Direct effect as read off", "$a_{read}/a$", "apparent_a", ("a",)),
        reading_panel("Evolution as read off", "$b_{read}/b$", "apparent_b", ("a", "b_over_a")),
        reading_panel(
            "Slip distance, by the load point",
            LENGTH_LABEL,
            "apparent_slip_distance",
            alike="length",
        ),
        reading_panel(
            "Slip distance, by slip", LENGTH_LABEL, "corrected_slip_distance", alike="length"
        ),
        reading_panel("Rate dependence as read off", "$(a-b)_{read}/(a-b)$", "a_minus_b_over_true"),
    ],
    height=48.0,
)


study = Study(
    name="velocity_steps",
    title="Velocity steps as an experimenter reads them, b/a = 2",
    summary=Study.caption(__doc__),
    base=base,
    axes=[
        Axis("law", ["slip", "slowness"]),
        Axis("velocity_ratio", STEPS),
        Axis("stiffness_ratio", STIFFNESS_RATIOS),
    ],
    measure=VelocityStep(),
    reductions=[
        ClosedFormRatio(name="a_minus_b_over_true", of="apparent_a_minus_b", form="net_weakening")
    ],
    claims=[
        *(rigid_limit_claim("slip", ratio) for ratio in STEPS),
        *(rigid_limit_claim("slowness", ratio) for ratio in (10.0, 100.0)),
        *(direct_effect_claim(law, ratio) for law in ("slip", "slowness") for ratio in (0.1, 10.0)),
        *(
            rate_dependence_claim(law, ratio)
            for law in ("slip", "slowness")
            for ratio in (0.1, 10.0)
        ),
        slip_distance_claim(0.1),
        slip_distance_claim(10.0),
    ],
    plot=figure,
    references=[
        "Marone (1998), Annu. Rev. Earth Planet. Sci. 26, 643-696",
        "Ruina (1983), J. Geophys. Res. 88, 10359-10370",
    ],
)
