"""Effect of slow fluid injection on the stability of steady sliding.

Pore pressure around the fault rises slowly and falls again, according to a sampled record. The
fault is either drained or dilatant. The pores of the dilatant fault drain into the surroundings at
a finite rate. Before the injection, the spring is slightly softer than critical. The critical
stiffness decreases with effective normal stress. Small perturbations therefore stop growing when k
exceeds the critical stiffness at the current pressure in the fault, and start to grow again when k
falls below the critical stiffness. For both laws, the comparison of k with the critical stiffness
predicts the pore pressure at which perturbations stop or start to grow. The error of the prediction
is about as large as the change of pressure within a time of one or two D_c/V_*. While the pressure
rises, slip is faster than V_0, and the ratio of drainage rate to slip rate is smaller. This smaller
ratio lowers the critical stiffness of a dilatant fault. Perturbations on a dilatant fault therefore
stop growing at a lower pressure than the pressure at which growth starts again.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
import xarray as xr
from scipy.optimize import brentq

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Scene, Study, history
from rsfstudy.measures import Measure, Outcome, Output, Status
from rsfstudy.motion import Integrator, MotionRecorder
from rsfstudy.slider import SampledHistory
from rsfstudy.slider.sampled_loading import TIME_COLUMN
from rsfstudy.study.figure_declarations import MatplotlibAxes, build_horizontal_line_overlay

#: Initial perturbation of spring stress relative to ``a``. The second value is the sampling
#: interval in D_c/V_*. The third value is the half-width of the window around an extremum, as a
#: fraction of the length of the record.
INITIAL_DEPARTURE, SAMPLING_INTERVAL, EXTREMUM_WINDOW = 1e-5, 0.25, 1.0 / 16.0

LOG_SLIP_RATE_COLUMN = MotionRecorder.MOTION_VARIABLE_NAMES.index("log10_slip_rate")
GROWTH_ENDS, GROWTH_BEGINS = "end", "begin"
_GROWTH_DESCRIPTIONS = {
    GROWTH_ENDS: "stop growing as pressure increases",
    GROWTH_BEGINS: "begin to grow as pressure decreases",
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
                f"pore pressure in the fault at which small perturbations {words}",
                "sigma_*",
                error=True,
            ),
            Output(
                f"{at}_stiffness_ratio",
                "$k/k_{cr}(p, V)$",
                "1",
                "stiffness divided by the critical stiffness, at the pressure and slip rate at "
                f"which small perturbations {words}",
                error=True,
            ),
        )
    ),
    Output(
        "critical_pressure",
        r"$(p-p_\infty)/\sigma_*$",
        "1",
        "pore pressure at which the stiffness is critical at V_0",
        "sigma_*",
    ),
)


def critical_stiffness(scene: Scene, pressure: float, velocity: float) -> float:
    r"""Compute the critical stiffness at a given pore pressure and slip rate.

    The parameter alpha must be zero. Let :math:`P` be the pore pressure and :math:`s = 1 - P` the
    effective normal stress, both in units of :math:`\sigma_*`. The critical stiffness of a drained
    fault is :math:`(b - a)\,s`. The critical stiffness of a dilatant fault is :math:`s K`, and
    :math:`K` solves

    .. math:: [K + a (1 + c) - b + E]\,[K (1 + c) - c (b - a)] = a c K,

    with :math:`c = c^* D_c/V` and :math:`E = \mu_* \epsilon/(\beta \sigma_* s)`.

    Parameters
    ----------
    scene : Scene
        Parameters of the slider.
    pressure : float
        Pore pressure in sigma_*.
    velocity : float
        Slip rate V/V_*.

    Returns
    -------
    float
        Critical stiffness in sigma_*/D_c.

    References
    ----------
    Segall and Rice (1995), J. Geophys. Res. 100, 22155-22171.
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
    """Pore pressures at which small perturbations stop or start to grow.

    The scene contains a record of pore pressure that rises until the middle of the record and then
    falls. The size of a perturbation has a maximum in the first half, when the perturbation stops
    growing, and a minimum in the second half, when the perturbation starts to grow again.
    """

    name: ClassVar[str] = "stabilisation"
    primary_output = "begin_pressure"
    typical_rhs_evaluations = 300_000
    outputs = _OUTPUTS

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the pressures from a motion and a perturbed motion.

        A second run with smaller tolerances provides the error estimates.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Outcome of the measure.
        """
        loading = scene.parts.loading
        if not isinstance(loading, SampledHistory) or not loading.of_pressure:
            return Outcome(Status.NO_STEP, message="the scene has no recorded pore pressure")
        if scene.normal_stress != "imposed" or scene.alpha or scene.parts.law.state_count > 1:
            why = (
                "the critical stiffness requires a law with one state, imposed normal stress, "
                "and alpha = 0"
            )
            return Outcome(Status.NOT_APPLICABLE, message=why)
        seen, refined = (
            _Departures.follow(scene, each) for each in (integrator, integrator.refined())
        )
        values, again = seen.find_extrema(scene), refined.find_extrema(scene)
        other = seen.find_extrema(scene, degree=5)
        errors = {
            f"{name}_error": integrator.estimate_error(value, again[name], 1.0)
            + abs(value - other[name])
            for name, value in values.items()
        }
        values["critical_pressure"] = _critical_pressure(scene)
        return Outcome(Status.OK, {**values, **errors})


class _Departures(NamedTuple):
    """Difference between a perturbed and an unperturbed motion.

    Attributes
    ----------
    time : ndarray
        Sample times of the unperturbed motion.
    pressure : ndarray
        Pore pressure in the fault at the sample times.
    log_slip_rate : ndarray
        ln(V/V_*) at the sample times.
    when : ndarray
        Times at which the absolute difference of ln V has a local maximum.
    log_size : ndarray
        Logarithm of the absolute difference of ln V at the times ``when``.
    """

    time: np.ndarray
    pressure: np.ndarray
    log_slip_rate: np.ndarray
    when: np.ndarray
    log_size: np.ndarray

    @classmethod
    def follow(cls, scene: Scene, integrator: Integrator) -> "_Departures":
        """Integrate the unperturbed and the perturbed motion over the record.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        _Departures
            Differences between the motions.
        """
        loading = scene.parts.loading
        assert isinstance(loading, SampledHistory)
        time = np.arange(
            SAMPLING_INTERVAL, loading.sample_table[-1, TIME_COLUMN], SAMPLING_INTERVAL
        )
        tables = []
        for departure in (0.0, INITIAL_DEPARTURE * scene.a):
            beside = scene.with_(initial_stress=scene.initial_stress + departure)
            recording = MotionRecorder(sample_times=time)
            for _event in integrator.follow(beside, recording=recording, until=float(time[-1])):
                pass
            tables.append(recording.as_table(beside))
        motion, other = (math.log(10.0) * table[:, LOG_SLIP_RATE_COLUMN] for table in tables)
        size = np.log(np.abs(other - motion))
        # The local maxima are refined with a parabola through three samples.
        before, at, after = size[:-2], size[1:-1], size[2:]
        tops = (at > before) & (at >= after)
        before, at, after = before[tops], at[tops], after[tops]
        off = 0.5 * (before - after) / (before - 2.0 * at + after)
        when = time[1:-1][tops] + SAMPLING_INTERVAL * off
        return cls(time, tables[0][:, -1], motion, when, at - 0.25 * (before - after) * off)

    def find_extrema(self, scene: Scene, degree: int = 3) -> dict[str, float]:
        """Find the pore pressures at the extrema of the perturbation.

        The maximum lies in the first half of the record, and the minimum lies in the second half.
        Each extremum is the root of the derivative of a polynomial that is fitted to the logarithm
        of the perturbation near the extremum.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        degree : int, default: 3
            Degree of the polynomial.

        Returns
        -------
        dict
            Pore pressure, and ratio of the stiffness to the critical stiffness, at both extrema.
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
    """Return the pore pressure at which the stiffness is critical at V_0."""

    def excess(pressure: float) -> float:
        """Return the critical stiffness minus the stiffness of the spring."""
        return critical_stiffness(scene, pressure, scene.load_velocity) - scene.stiffness

    return float(brentq(excess, -1.0, 0.99))


# ---- the study -----------------------------------------------------------------------------------

#: Durations of the pressure records in D_c/V_*, and the maximum pressure in sigma_*, which is
#: reached in the middle of the record.
RECORD_DURATIONS, MAX_PRESSURE = [500.0, 1000.0, 2000.0], 0.04
SLOWEST_RECORD = f"{RECORD_DURATIONS[-1]:g}"
#: Number of samples of a pressure record.
RECORD_SAMPLES = 401
LAWS = ("slip", "slowness")
DRAINAGES = [0.1, 0.3, 1.0, 3.0, 10.0]
DRAINED = "drained"


def _case_name(drainage: float) -> str:
    """Return the name of a dilatant case."""
    return f"dilatant, c* = {drainage:g}"


CASES: dict[str, dict[str, str | float]] = {
    DRAINED: {"fluid": "drained"},
    **{_case_name(c): {"fluid": "dilatant", "dilatancy": 0.004, "drainage": c} for c in DRAINAGES},
}
base = Scene(normal_stress="imposed", alpha=0.0, b_over_a=2.0, stiffness_ratio=0.98)


def pressure_record(lasts: float) -> SampledHistory:
    """Return a record of pore pressure that rises and falls as a cosine.

    Parameters
    ----------
    lasts : float
        Duration of the record in D_c/V_*.

    Returns
    -------
    SampledHistory
        Loading history with pore pressure.
    """
    time = np.linspace(0.0, lasts, RECORD_SAMPLES)
    pressure = 0.5 * MAX_PRESSURE * (1.0 - np.cos(2.0 * math.pi * time / lasts))
    return history({"time": time, "pore_pressure": pressure}, name=f"within_{lasts:g}")


def max_pressure_rate(lasts: float) -> float:
    """Return the maximum rate of change of pore pressure.

    Parameters
    ----------
    lasts : float
        Duration of the record in D_c/V_*.

    Returns
    -------
    float
        Rate in sigma_* V_*/D_c.
    """
    return math.pi * MAX_PRESSURE / lasts


def critical_stiffness_claim(at: str, law: str, case: str) -> Claim:
    """Return the claim that the growth rate of perturbations is zero at k = k_cr (I1).

    Parameters
    ----------
    at : str
        Name of the extremum: "end" or "begin".
    law : str
        State evolution law.
    case : str
        Name of the case.

    Returns
    -------
    Claim
        Claim about the ratio of stiffness to critical stiffness.
    """
    return Claim(
        id="I1",
        statement=(
            f"{law} law, {case}, slowest record: k/k_cr when small perturbations "
            f"{_GROWTH_DESCRIPTIONS[at]}"
        ),
        source="critical stiffness at the current pressure and slip rate",
        variable=f"{at}_stiffness_ratio",
        where={"law": law, "case": case, "record": SLOWEST_RECORD},
        published=1.0,
        tolerance=2.0 * max_pressure_rate(RECORD_DURATIONS[-1]),
        reason="the pressure change within 2 D_c/V_*, the time in which the state and the porosity "
        "evolve",
    )


def critical_pressure_claim(at: str, law: str, case: str, within: float, reason: str) -> Claim:
    """Return the claim that growth stops or starts at the critical pore pressure (I2).

    Parameters
    ----------
    at : str
        Name of the extremum: "end" or "begin".
    law : str
        State evolution law.
    case : str
        Name of the case.
    within : float
        Tolerance of the claim in sigma_*.
    reason : str
        Reason for the tolerance.

    Returns
    -------
    Claim
        Claim about the difference from the critical pressure at V_0.
    """
    where = {"law": law, "case": case, "record": SLOWEST_RECORD}
    return Claim(
        id="I2",
        statement=(
            f"{law} law, {case}, slowest record: pressure when small perturbations "
            f"{_GROWTH_DESCRIPTIONS[at]}, minus the pressure at which k is critical at V_0"
        ),
        source="critical stiffness at the current pressure",
        variable=f"{at}_pressure",
        where=where,
        baseline=where,
        baseline_variable="critical_pressure",
        published=0.0,
        tolerance=within,
        reason=reason,
    )


#: Maximum increase of the slip rate relative to V_*. Shear stress follows mu_* P, so the slip rate
#: is highest when pressure changes fastest.
MAX_SLIP_RATE_EXCESS = base.mu_star * max_pressure_rate(RECORD_DURATIONS[-1]) / base.stiffness
CHANGE_REASON = "the pressure change within 2 D_c/V_*"
RATE_REASON = (
    "the slip rate changes by (mu_*/K) dP/dt; c* D_c/V has the same relative change, and k_cr has "
    "at most a fifth of this change, because k_cr decreases by 21 % from drained to undrained "
    "conditions"
)


def pressure_panel(at: str) -> Panel:
    """Return a panel of the pore pressures at which perturbations stop or start to grow.

    Parameters
    ----------
    at : str
        Name of the extremum: "end" or "begin".

    Returns
    -------
    Panel
        Panel with the measured pressures and the closed forms.
    """
    return Panel(
        x="drainage",
        y=f"{at}_pressure",
        hue=["record"],
        isel={"law": 0},
        markers_only=True,
        log="x",
        overlays=[plot_critical_pressure],
        y_label=f"Pore pressure at which instability {at}s",
        title="",
        legend_title="Length of the record ($D_c/V_*$)",
        y_scale_group="pressure",
    )


def plot_critical_pressure(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw the critical pore pressure at V_0 as a function of the drainage rate.

    The value of a drained fault is drawn as a dotted line.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    drainages = np.geomspace(0.5 * DRAINAGES[0], 2.0 * DRAINAGES[-1], 100)
    scenes = (base.with_(**CASES[_case_name(1.0)] | {"drainage": c}) for c in drainages.tolist())
    found = [_critical_pressure(scene) for scene in scenes]
    axes.plot(drainages, found, color="0.3", linewidth=0.8, label="k critical at $V_0$")
    build_horizontal_line_overlay(
        _critical_pressure(base), color="0.3", linestyle=":", label="drained"
    )(dataset, axes)


def pressure_rates(row: xr.Dataset) -> xr.DataArray:
    """Return the maximum rate of change of pore pressure in each record.

    Parameters
    ----------
    row : xarray.Dataset
        Results along the dimension ``record``.

    Returns
    -------
    xarray.DataArray
        Rates in sigma_* V_*/D_c.
    """
    return xr.DataArray(
        [max_pressure_rate(float(label)) for label in row["record"].values], dims="record"
    )


def plot_one_to_one_line(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw a line that shows how much the pressure changes within the time D_c/V_*.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    known = pressure_rates(dataset)
    axes.plot(known, known, color="0.8", linewidth=2.2, label="change within $D_c/V_*$", zorder=1.5)


def stiffness_deviation_panel(at: str) -> Panel:
    """Return a panel that shows how much k differs from the critical stiffness.

    The critical stiffness is evaluated at the current pressure and slip rate.

    Parameters
    ----------
    at : str
        Name of the extremum: "end" or "begin".

    Returns
    -------
    Panel
        Panel with the deviations.
    """
    return Panel(
        x=pressure_rates,
        y=lambda row: abs(row[f"{at}_stiffness_ratio"] - 1.0),
        hue=["case"],
        isel={"law": 0},
        markers_only=True,
        log="xy",
        overlays=[plot_one_to_one_line],
        x_label=r"Fastest change of pressure ($\sigma_* V_*/D_c$)",
        y_label=rf"$|k/k_{{cr}} - 1|$ at which instability {at}s",
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
    title="Slow injection that ends instability and lets it begin again, initially k = 0.98 k_cr",
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
