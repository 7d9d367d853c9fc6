"""Recovery of known parameters from records without noise.

The study computes records without noise for all laws with one state variable, and for a negative
value of b. In further cases, the stiffness, alpha, the exponent of the law or the time of the step
is a free parameter. Initial parameters of the fits differ from the exact values by 20 to 50 %. All
fits recover the exact parameters. Some records are simulated with the same model that is then
fitted to them. To test this model, other records are computed from different equations with a SciPy
integrator. Dashed lines show the maximum deviations that the claims permit.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.special import lambertw

from rsfstudy import Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.errors import InvalidValue
from rsfstudy.fitting import LOGARITHMIC_PARAMETERS, PARAMETERS, scene_to_parameters
from rsfstudy.fitting.fit_problem import FitProblem
from rsfstudy.fitting.joint_window_model import JointWindowModel
from rsfstudy.fitting.window_model import ParameterValues, WindowModel
from rsfstudy.measures import Measure, Outcome, Output, OutputValue, Quantity, Status
from rsfstudy.motion import Integrator
from rsfstudy.study.figure_declarations import MatplotlibAxes

from ._synthetic_fit import FIT_ACCURACY

#: Slip distance in um, number of rows of a record, and relative tolerance of the motion.
SLIP_DISTANCE, ROWS, MOTION_RTOL = 10.0, 300, 1e-9
#: Duration in s of steady sliding before the record begins. The time of the step may vary by this
#: duration.
STEADY_TIME_BEFORE_RECORD = 5.0
#: Loading histories by name. Each row contains the time in s, the load point velocity in um/s,
#: normal stress relative to its initial value, and the rate of change of this ratio in 1/s. The
#: last number is the end of the record in s.
LOADINGS = {
    "step up": (((0.0, 1.0, 1.0, 0.0), (40.0, 10.0, 1.0, 0.0)), 55.0),
    "step down": (((0.0, 10.0, 1.0, 0.0), (4.0, 1.0, 1.0, 0.0)), 154.0),
    "normal stress step": (
        (
            (0.0, 1.0, 1.0, 0.0),
            (40.0, 1.0, 1.0, 0.2),
            (40.5, 1.0, 1.1, 0.0),
            (120.0, 10.0, 1.1, 0.0),
        ),
        135.0,
    ),
}
#: Ratios of initial parameters to exact parameters. The second dictionary contains differences
#: between initial and exact parameters.
INITIAL_FACTORS = {"a": 1.2, "b": 0.8, "slip_distance": 1.5, "stiffness": 1.3}
INITIAL_OFFSETS = {"alpha": 0.1, "law_exponent": 0.2}
#: Largest deviation of a parameter for each method that computes the record. If the record was
#: computed with the model of the fit, the deviation is due to rounding and to the termination of
#: the fit. If the record was computed with other code, the deviation is due to the numerical errors
#: of both motions. Correlations between the parameters amplify these errors.
MAX_DEVIATIONS = {"the model": 1e-8, "other code": 1e-6}


@dataclass(frozen=True)
class RecoveryError(Measure):
    """Deviation of fitted parameters from the exact parameters of a record.

    The record has no noise.

    Parameters
    ----------
    loading_of_record : str, default: "step up"
        Name of the loading history, a key of ``LOADINGS``.
    looked_for : str, default: "a b slip_distance mu_star trend1"
        Names of the free parameters, separated by spaces.
    record_by : {"the model", "other code"}, default: "the model"
        Method that computes the record: the model of the fit, or equations for friction and
        ln(theta) with an integrator of SciPy.
    """

    loading_of_record: str = "step up"
    looked_for: str = "a b slip_distance mu_star trend1"
    record_by: str = "the model"
    name: ClassVar[str] = "recovered"
    primary_output = "largest_deviation"
    typical_rhs_evaluations = 200_000
    dimensions = (
        Quantity("parameter", "", "", "fitted parameter"),
        Quantity("loading_of_record", "", "", "loading of the record"),
        Quantity("looked_for", "", "", "fitted parameters"),
        Quantity("record_by", "", "", "source of the record"),
    )
    outputs = (
        Output(
            "largest_deviation",
            "",
            "1",
            "largest relative deviation of a parameter",
            error=True,
        ),
        Output(
            "deviation",
            "",
            "1",
            "relative deviation of the parameter from the true value",
            dims=("parameter",),
        ),
    )

    def __post_init__(self) -> None:
        """Check the parameters."""
        if self.loading_of_record not in LOADINGS:
            name, value = "loading_of_record", self.loading_of_record
            raise InvalidValue(name, value, "is unknown", choices=LOADINGS)
        if self.record_by not in MAX_DEVIATIONS:
            raise InvalidValue("record_by", self.record_by, "is unknown", choices=MAX_DEVIATIONS)
        for name in self.looked_for.split():
            if name not in PARAMETERS:
                raise InvalidValue("looked_for", name, "is not a parameter", choices=PARAMETERS)

    @property
    def output_coordinates(self) -> Mapping[str, np.ndarray]:
        """Names of all parameters."""
        return {"parameter": np.array([*PARAMETERS], dtype=object)}

    def error_scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Return an error scale of 1 for the largest deviation.

        The deviations of the parameters are already divided by the scales of the parameters.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        values : mapping
            Results, keyed by name.

        Returns
        -------
        mapping
            Error scale of each result.
        """
        return {"largest_deviation": 1.0}

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute a record, and fit the record.

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
        free, true = self.looked_for.split(), scene_to_parameters(scene, SLIP_DISTANCE, math.nan)
        true |= {name: 0.0 for name in free if name not in true}
        smooth = integrator.tightened_to(MOTION_RTOL)
        model = self._record_model(scene, smooth)
        made = (
            model.compute_model_friction(true)
            if self.record_by == "the model"
            else _friction_by_scipy(model, true)
        )
        model = replace(model, recorded_friction=made)
        first = {
            n: v * INITIAL_FACTORS.get(n, 1.0) + INITIAL_OFFSETS.get(n, 0.0) if n in free else v
            for n, v in true.items()
        }
        found = FitProblem(JointWindowModel((model,)), first, free, "white").solve()
        sizes = {name: _parameter_scale(name, true) for name in free}
        off = {name: (found.parameter_values[name] - true[name]) / sizes[name] for name in free}
        values: dict[str, OutputValue] = {
            "largest_deviation": max(map(abs, off.values())),
            "largest_deviation_error": max(
                found.parameter_numerical_errors[name] / sizes[name] for name in free
            ),
            "deviation": np.array([off.get(name, math.nan) for name in PARAMETERS]),
        }
        return Outcome(Status.OK, values)

    def _record_model(self, scene: Scene, integrator: Integrator) -> WindowModel:
        """Return the model of the record.

        Rows are evenly spaced in load point displacement.
        """
        pieces, ends = LOADINGS[self.loading_of_record]
        loading = np.array(pieces)
        begins, knots = loading[:, 0], [*loading[:, 0], ends]
        moved = np.concatenate([[0.0], np.cumsum(np.diff(knots) * loading[:, 1])])
        at = np.linspace(0.0, moved[-1], ROWS)
        time = np.interp(at, moved, knots)
        step = moved[np.argmax(begins > 0.0)]
        loading[0, 0] -= STEADY_TIME_BEFORE_RECORD
        return WindowModel(scene, time, at - step, np.zeros(ROWS), loading, integrator)


def _friction_by_scipy(model: WindowModel, true: ParameterValues) -> np.ndarray:
    r"""Compute the friction of a record with an independent implementation.

    The unknowns are the product of normal stress :math:`\sigma` and friction :math:`\mu`, and the
    state :math:`\Psi = \ln\theta + (\alpha/b) \ln\sigma`. Normal stress and :math:`\theta` are
    relative to their initial values, and :math:`w = \ln(V/V_0)`. The equations are

    .. math::

        \frac{d(\sigma\mu)}{dt} = k\,(V_l - V), \qquad
        \frac{d\Psi}{dt} = \frac{V}{D_c}\,h(\ln\theta + w).

    Parameters
    ----------
    model : WindowModel
        Model of the record, which contains the times and the loading history.
    true : Values
        Exact parameters.

    Returns
    -------
    ndarray
        Friction at the times of the rows.
    """
    a, b, k, distance = (true[n] for n in ("a", "b", "stiffness", "slip_distance"))
    law, first, alpha = model.scene.law, model.initial_velocity, true.get("alpha", 0.0)
    cutoff = float(model.scene.as_dict().get("cutoff_velocity_ratio") or 1.0)
    ahead = float(lambertw(math.exp(-1.0 / cutoff)).real)

    def change(u: float, speed: float) -> float:
        """Return the function h of the evolution law."""
        power = true.get("law_exponent", 1.0)
        return {
            "slip": -u,
            "perrin_rice_zheng": -math.sinh(u),
            "composite": math.exp(-speed / cutoff - u - ahead) - u - ahead,
        }.get(law, math.expm1(-power * u) / power)

    def state(psi: float) -> float:
        """Return the contribution of the state to friction."""
        if law == "cut_off":
            return b * (math.log1p(cutoff * math.exp(psi)) - math.log1p(cutoff))
        return b * psi

    def rates(t: float, y: np.ndarray, piece: np.ndarray) -> list[float]:
        """Evaluate the right-hand side."""
        stress = piece[2] + piece[3] * (t - piece[0])
        psi = y[1] - alpha / b * math.log(stress)
        w = (y[0] / stress - true["mu_star"] - state(psi)) / a
        speed = math.exp(w)
        return [k * (piece[1] - first * speed), first * speed / distance * change(psi + w, speed)]

    time, y = model.time - true.get("step_time", 0.0), np.array([true["mu_star"], 0.0])
    found, ends = np.empty(len(time)), [*model.loading_segments[1:, 0], time[-1]]
    for piece, end in zip(model.loading_segments, ends, strict=True):
        rows = (time >= piece[0]) & (time <= end)
        at = np.unique([*time[rows], end])
        solved = solve_ivp(
            rates, (piece[0], end), y, "DOP853", at, args=(piece,), rtol=1e-11, atol=1e-13
        )
        stress, y = piece[2] + piece[3] * (time[rows] - piece[0]), solved.y[:, -1]
        found[rows] = solved.y[0, : rows.sum()] / stress
    return found


def _parameter_scale(name: str, true: ParameterValues) -> float:
    """Return the scale by which the deviations of a parameter are divided.

    If the logarithm of a parameter is fitted, the scale is the exact value of the parameter. The
    scale for ``a`` and ``b`` is the larger of the absolute values of ``a`` and ``b``. The scale for
    a trend is the trend that changes friction by 1 over the window. The scale is 1 for all other
    parameters.
    """
    if name in LOGARITHMIC_PARAMETERS:
        return true[name]
    sizes = dict.fromkeys(("a", "b"), max(true["a"], abs(true["b"])))
    return (sizes | {"trend1": 1.0 / (15.0 * SLIP_DISTANCE)}).get(name, 1.0)


NORMAL_STRESS_STEP_CASE = {
    "normal_stress": "imposed",
    "alpha": 0.3,
    "loading_of_record": "normal stress step",
    "looked_for": "a b slip_distance mu_star alpha",
}
CASES = {
    "slip": {"law": "slip"},
    "slowness": {"law": "slowness"},
    "Perrin-Rice-Zheng": {"law": "perrin_rice_zheng"},
    "composite": {"law": "composite"},
    "cut-off": {"law": "cut_off"},
    "family": {"law": "family", "law_exponent": 0.3},
    "free exponent": {
        "law": "family",
        "law_exponent": 0.3,
        "looked_for": "a b slip_distance mu_star law_exponent",
    },
    "free stiffness": {"law": "slip", "looked_for": "a b slip_distance mu_star stiffness"},
    "free step time": {"law": "slip", "looked_for": "a b slip_distance mu_star step_time"},
    "step down": {"law": "slowness", "loading_of_record": "step down"},
    "b < 0": {"law": "slowness", "b_over_a": -0.4},
    "b < 0, slip": {"law": "slip", "b_over_a": -0.4},
    "normal stress step": {"law": "slip", **NORMAL_STRESS_STEP_CASE},
    "the same, slowness": {"law": "slowness", **NORMAL_STRESS_STEP_CASE},
}


def plot_allowed_deviations(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw lines at the maximum deviations that the claims permit.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    from rsfstudy.plots import cycle_style

    for number, source in enumerate(dataset["record_by"].values):
        colour = cycle_style(number)["color"]
        axes.axvline(MAX_DEVIATIONS[str(source)], color=colour, linestyle="--", linewidth=0.8)


figure = Figure(
    [
        Panel(
            x=lambda row: row["largest_deviation"].clip(min=1e-16),
            y="case",
            hue=["record_by"],
            overlays=[plot_allowed_deviations],
            y_label="Record",
            x_label="Largest deviation of a parameter",
            log="x",
        )
    ]
)


def recovery_claim(case: str, source: str) -> Claim:
    """Return the claim that a fit recovers the exact parameters (F4).

    Parameters
    ----------
    case : str
        Name of the case.
    source : str
        Method that computes the record.

    Returns
    -------
    Claim
        Claim about the largest deviation.
    """
    reasons = {
        "the model": "termination of the fit, and rounding",
        "other code": "a hundred times the ratio of the errors of both motions (1e-11) to the "
        "effect of the slip distance on friction (5e-3), because the parameters are correlated",
    }
    return Claim.below(
        id="F4",
        statement=f"{case}: the fit recovers the parameters of a record from {source}",
        source="identity of model and record",
        variable="largest_deviation",
        where={"case": case, "record_by": source},
        published=MAX_DEVIATIONS[source],
        reason=reasons[source],
    )


study = Study(
    name="fit_recovery",
    title="Deviations of fitted parameters from those of records without noise",
    summary=Study.caption(__doc__),
    base=Scene(normal_stress="constant", a=0.01, b_over_a=1.3, mu_star=0.6, stiffness=0.03),
    axes=[
        Axis("case", CASES),
        Axis("record_by", list(MAX_DEVIATIONS)),
    ],
    measure=RecoveryError(),
    claims=[recovery_claim(case, source) for case in CASES for source in MAX_DEVIATIONS],
    plot=figure,
    accuracy=FIT_ACCURACY,
    references=["Marone (1998), Annu. Rev. Earth Planet. Sci. 26, 643-696"],
)
