"""Injection: fluid pressed slowly into a fault ends instability, and begins it as it flows back.

Pore pressure around a fault rises slowly, as it was sampled, and falls again; on a drained fault
and on ones that dilate, into which it drains. The spring is a little softer than critical before.
Small departures stop growing where k exceeds the critical stiffness at the pressure of the moment
in the fault, which falls with effective normal stress, and begin to grow again where k falls below
it: to the change of pressure within one or two D_c/V_*, by both laws. While pressure rises slip is
faster, and drainage over slip rate less, so that dilatancy ends instability at lower pressure than
it begins at.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
import xarray as xr
from scipy.optimize import brentq

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Scene, Study, history
from rsfstudy.measures import Measure, Outcome, Output, Status
from rsfstudy.motion import MOTION_VARIABLES, Recording, WorkMeter, estimate_error, integrate_events
from rsfstudy.slider import SampledHistory
from rsfstudy.slider.sampled_history import TIME_COLUMN
from rsfstudy.study.figure_declarations import Axes, horizontal_line

#: Initial departure of spring stress, over a; samples in D_c/V_*; and part of the record around an
#: extreme of the size of departures that is looked at for it.
INITIAL_DEPARTURE, SAMPLING_INTERVAL, EXTREMUM_WINDOW = 1e-5, 0.25, 1.0 / 16.0

LOG_SLIP_RATE_COLUMN = MOTION_VARIABLES.index("log10_slip_rate")
GROWTH_ENDS, GROWTH_BEGINS = "end", "begin"
_GROWTH_DESCRIPTIONS = {
    GROWTH_ENDS: "stop growing as pressure rises",
    GROWTH_BEGINS: "begin to grow as it falls",
}
_OUTPUTS = (
    *(
        about
        for at, words in _GROWTH_DESCRIPTIONS.items()
        for about in (
            Output(
                f"{at}_pressure",
                r"$(p-p_\infty)/\sigma_*$",
                "1",
                f"pore pressure in the fault at which small departures {words}",
                "sigma_*",
                error=True,
            ),
            Output(
                f"{at}_stiffness_ratio",
                "$k/k_{cr}(p, V)$",
                "1",
                "stiffness over the critical one at the pressure and slip rate at which small "
                f"departures {words}",
                error=True,
            ),
        )
    ),
    Output(
        "critical_pressure",
        r"$(p-p_\infty)/\sigma_*$",
        "1",
        "pore pressure at which stiffness is critical at V_0",
        "sigma_*",
    ),
)


def critical_stiffness(scene: Scene, pressure: float, velocity: float) -> float:
    """k_cr D_c/sigma_* at a pore pressure and a slip rate over V_*, at alpha = 0.

    Drained ``(b - a) s`` with s = 1 - P; else s times the root of
    ``[K + a (1 + c) - b + E] [K (1 + c) - c (b - a)] = a c K`` with c = c* D_c/V and E = mu_*
    eps/(beta sigma_* s) (Segall and Rice, 1995).
    """
    a, weakening, ratio = scene.a, scene.b - scene.a, 1.0 - pressure
    if scene.fluid == "drained":
        return weakening * ratio
    c = scene.drainage / velocity
    less = a * c - weakening + scene.mu_star * scene.dilatancy / ratio
    linear = less * (1.0 + c) - c * weakening - a * c
    both = -less * c * weakening
    root = math.sqrt(linear * linear - 4.0 * (1.0 + c) * both)
    return float(ratio * (root - linear) / (2.0 * (1.0 + c)))


@dataclass(frozen=True)
class StabilisationPressure(Measure):
    """Pore pressures at which small departures from a motion stop growing while a record of
    pressure rises, up to its middle, and begin to grow again while it falls: where the size of a
    departure has its maximum and its minimum.
    """

    name: ClassVar[str] = "stabilisation"
    primary_output = "begin_pressure"
    typical_work = 300_000
    outputs = _OUTPUTS

    def compute(self, scene: Scene, accuracy: Accuracy, meter: WorkMeter) -> Outcome:
        """From the motion and one that begins a little beside it; and once more with smaller
        tolerances for the errors.
        """
        loading = scene.parts.loading
        if not isinstance(loading, SampledHistory) or not loading.of_pressure:
            return Outcome(Status.NO_STEP, message="there is no record of pore pressure")
        if scene.normal_stress != "imposed" or scene.alpha or scene.parts.law.state_count > 1:
            why = "critical stiffness is that of one state and imposed normal stress, alpha = 0"
            return Outcome(Status.NOT_APPLICABLE, message=why)
        seen, refined = (
            _Departures.follow(scene, a, meter) for a in (accuracy, accuracy.refined())
        )
        values, again = seen.find_extrema(scene), refined.find_extrema(scene)
        other = seen.find_extrema(scene, degree=5)
        errors = {
            f"{name}_error": estimate_error(value, again[name], accuracy.rtol)
            + abs(value - other[name])
            for name, value in values.items()
        }
        values["critical_pressure"] = _critical_pressure(scene)
        return Outcome(Status.OK, {**values, **errors})


class _Departures(NamedTuple):
    """Departures of a motion from another.

    Attributes
    ----------
    time, pressure, log_slip_rate : ndarray
        Of the motion: time, pore pressure in the fault, and ln(V/V_*).
    when, log_size : ndarray
        Times at which the departure of ln V is largest, either way, and the logarithms of these.
    """

    time: np.ndarray
    pressure: np.ndarray
    log_slip_rate: np.ndarray
    when: np.ndarray
    log_size: np.ndarray

    @classmethod
    def follow(cls, scene: Scene, accuracy: Accuracy, meter: WorkMeter) -> "_Departures":
        """Departures of a motion that begins a little beside another, along a record."""
        loading = scene.parts.loading
        assert isinstance(loading, SampledHistory)
        time = np.arange(
            SAMPLING_INTERVAL, loading.sample_table[-1, TIME_COLUMN], SAMPLING_INTERVAL
        )
        tables = []
        for departure in (0.0, INITIAL_DEPARTURE * scene.a):
            beside = scene.with_(initial_stress=scene.initial_stress + departure)
            recording = Recording(sample_times=time)
            for _event in integrate_events(
                beside, accuracy, meter, recording=recording, until=float(time[-1])
            ):
                pass
            tables.append(recording.table(beside))
        motion, other = (math.log(10.0) * table[:, LOG_SLIP_RATE_COLUMN] for table in tables)
        size = np.log(np.abs(other - motion))
        # of the largest of three neighbours, the parabola through them
        before, at, after = size[:-2], size[1:-1], size[2:]
        tops = (at > before) & (at >= after)
        before, at, after = before[tops], at[tops], after[tops]
        off = 0.5 * (before - after) / (before - 2.0 * at + after)
        when = time[1:-1][tops] + SAMPLING_INTERVAL * off
        return cls(time, tables[0][:, -1], motion, when, at - 0.25 * (before - after) * off)

    def find_extrema(self, scene: Scene, degree: int = 3) -> dict[str, float]:
        """Pore pressures, and stiffness over the critical one there, where the size of departures
        has its maximum in the first half of the record, and its minimum in the second: of a
        polynomial through those around it.
        """
        lasts, values = float(self.time[-1]), {}
        for at, sign, half in ((GROWTH_ENDS, 1.0, 0.0), (GROWTH_BEGINS, -1.0, 0.5)):
            within = (self.when > half * lasts) & (self.when < (half + 0.5) * lasts)
            when, size = self.when[within], sign * self.log_size[within]
            top = when[np.argmax(size)]
            around = np.abs(when - top) < EXTREMUM_WINDOW * lasts
            slopes = np.polyder(np.polyfit(when[around] - top, size[around], degree))
            roots = np.roots(slopes)
            turn = top + float(roots[np.argmin(np.abs(roots))].real)
            pressure = float(np.interp(turn, self.time, self.pressure))
            velocity = math.exp(np.interp(turn, self.time, self.log_slip_rate))
            values[f"{at}_pressure"] = pressure
            critical = critical_stiffness(scene, pressure, velocity)
            values[f"{at}_stiffness_ratio"] = scene.stiffness / critical
        return values


def _critical_pressure(scene: Scene) -> float:
    """Pore pressure at which stiffness is critical at V_0."""

    def excess(pressure: float) -> float:
        return critical_stiffness(scene, pressure, scene.load_velocity) - scene.stiffness

    return float(brentq(excess, -1.0, 0.99))


# ---- the study -----------------------------------------------------------------------------------

#: How long records last, in D_c/V_*, and the highest pressure, over sigma_*, in their middle.
RECORD_DURATIONS, MAX_PRESSURE = [500.0, 1000.0, 2000.0], 0.04
SLOWEST_RECORD = f"{RECORD_DURATIONS[-1]:g}"
#: Samples of a record.
RECORD_SAMPLES = 401
LAWS = ("slip", "slowness")
DRAINAGES = [0.1, 0.3, 1.0, 3.0, 10.0]
DRAINED = "drained"


def _case_name(drainage: float) -> str:
    return f"dilatant, c* = {drainage:g}"


CASES: dict[str, dict[str, str | float]] = {
    DRAINED: {"fluid": "drained"},
    **{_case_name(c): {"fluid": "dilatant", "dilatancy": 0.004, "drainage": c} for c in DRAINAGES},
}
base = Scene(normal_stress="imposed", alpha=0.0, b_over_a=2.0, stiffness_ratio=0.98)


def pressure_record(lasts: float) -> SampledHistory:
    """A record of pressure that rises and falls as a cosine does."""
    time = np.linspace(0.0, lasts, RECORD_SAMPLES)
    pressure = 0.5 * MAX_PRESSURE * (1.0 - np.cos(2.0 * math.pi * time / lasts))
    return history({"time": time, "pore_pressure": pressure}, name=f"within_{lasts:g}")


def max_pressure_rate(lasts: float) -> float:
    """The largest rate of pressure, in sigma_* V_*/D_c."""
    return math.pi * MAX_PRESSURE / lasts


def critical_stiffness_claim(at: str, law: str, case: str) -> Claim:
    """I1: stiffness is critical there."""
    return Claim(
        id="I1",
        statement=f"{law} law, {case}, slowest record: k/k_cr where small departures "
        f"{_GROWTH_DESCRIPTIONS[at]}",
        source="critical stiffness at the pressure and slip rate of the moment",
        variable=f"{at}_stiffness_ratio",
        where={"law": law, "case": case, "record": SLOWEST_RECORD},
        published=1.0,
        tolerance=2.0 * max_pressure_rate(RECORD_DURATIONS[-1]),
        reason="by how much pressure changes within 2 D_c/V_*, in which contact and pores evolve",
    )


def critical_pressure_claim(at: str, law: str, case: str, within: float, reason: str) -> Claim:
    """I2: the pressure itself."""
    where = {"law": law, "case": case, "record": SLOWEST_RECORD}
    return Claim(
        id="I2",
        statement=f"{law} law, {case}, slowest record: pressure where small departures "
        f"{_GROWTH_DESCRIPTIONS[at]}, less that at which k is critical at V_0",
        source="critical stiffness at the pressure of the moment",
        variable=f"{at}_pressure",
        where=where,
        minus=where,
        minus_variable="critical_pressure",
        published=0.0,
        tolerance=within,
        reason=reason,
    )


#: By how much slip is faster where pressure changes fastest, over V_*: shear stress follows mu_* P.
MAX_SLIP_RATE_EXCESS = base.mu_star * max_pressure_rate(RECORD_DURATIONS[-1]) / base.stiffness
CHANGE_REASON = "by how much pressure changes within 2 D_c/V_*"
RATE_REASON = (
    "slip is faster or slower by mu_* dP/dt over K, which changes c* D_c/V by as much and k_cr by "
    "a fifth of that at most: it falls by 0.21 of itself from drained to undrained"
)


def pressure_panel(at: str) -> Panel:
    """Pore pressures at which departures stop or begin to grow, beside closed forms."""
    return Panel(
        x="drainage",
        y=f"{at}_pressure",
        hue=["record"],
        isel={"law": 0},
        markers_only=True,
        log="x",
        overlays=[plot_critical_pressure],
        y_label=f"Pore pressure where instability {at}s",
        title="",
        legend_title="Length of the record ($D_c/V_*$)",
        y_scale_group="pressure",
    )


def plot_critical_pressure(dataset: xr.Dataset, axes: Axes) -> None:
    """Pressure at which stiffness is critical at V_0, against drainage, and drained."""
    drainages = np.geomspace(0.5 * DRAINAGES[0], 2.0 * DRAINAGES[-1], 100)
    scenes = (base.with_(**CASES[_case_name(1.0)] | {"drainage": c}) for c in drainages.tolist())
    found = [_critical_pressure(scene) for scene in scenes]
    axes.plot(drainages, found, color="0.3", linewidth=0.8, label="k critical at $V_0$")
    horizontal_line(_critical_pressure(base), color="0.3", linestyle=":", label="drained")(
        dataset, axes
    )


def pressure_rates(row: xr.Dataset) -> xr.DataArray:
    """Fastest change of pressure of each record."""
    return xr.DataArray(
        [max_pressure_rate(float(label)) for label in row["record"].values], dims="record"
    )


def plot_one_to_one_line(dataset: xr.Dataset, axes: Axes) -> None:
    """Change of pressure within D_c/V_*."""
    known = pressure_rates(dataset)
    axes.plot(known, known, color="0.8", linewidth=2.2, label="change within $D_c/V_*$", zorder=1.5)


def stiffness_deviation_panel(at: str) -> Panel:
    """How far from critical stiffness is where they do, at pressure and slip rate of the moment."""
    return Panel(
        x=pressure_rates,
        y=lambda row: abs(row[f"{at}_stiffness_ratio"] - 1.0),
        hue=["case"],
        isel={"law": 0},
        markers_only=True,
        log="xy",
        overlays=[plot_one_to_one_line],
        x_label=r"Fastest change of pressure ($\sigma_* V_*/D_c$)",
        y_label=rf"$|k/k_{{cr}} - 1|$ where instability {at}s",
        title="",
        y_scale_group="off",
    )


figure = Figure(
    [
        pressure_panel(GROWTH_ENDS),
        pressure_panel(GROWTH_BEGINS),
        stiffness_deviation_panel(GROWTH_ENDS),
        stiffness_deviation_panel(GROWTH_BEGINS),
    ],
    height=50.0,
)

study = Study(
    name="injection",
    title="Slow injection ends instability, and begins it: k = 0.98 k_cr before",
    summary=Study.caption(__doc__),
    base=base,
    axes=[
        Axis("law", LAWS),
        Axis("case", CASES),
        Axis(
            "record",
            {f"{lasts:g}": {"loading": pressure_record(lasts)} for lasts in RECORD_DURATIONS},
        ),
    ],
    measure=StabilisationPressure(),
    accuracy=Accuracy(rtol=1e-9, budget=4_000_000),
    claims=[
        *(
            critical_stiffness_claim(at, law, case)
            for at in _GROWTH_DESCRIPTIONS
            for law in LAWS
            for case in CASES
        ),
        *(
            critical_pressure_claim(
                at, law, DRAINED, 2.0 * max_pressure_rate(RECORD_DURATIONS[-1]), CHANGE_REASON
            )
            for at in _GROWTH_DESCRIPTIONS
            for law in LAWS
        ),
        *(
            critical_pressure_claim(
                at, law, _case_name(1.0), 0.2 * MAX_SLIP_RATE_EXCESS, RATE_REASON
            )
            for at in _GROWTH_DESCRIPTIONS
            for law in LAWS
        ),
    ],
    plot=figure,
    references=["Segall and Rice (1995), J. Geophys. Res. 100, 22155-22171"],
)
