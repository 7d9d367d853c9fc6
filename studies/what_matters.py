"""Sobol indices of critical displacement, stress drop and recurrence interval.

The parameters a, b - a and k are uncertain by 10 % each, and their errors are independent. The
critical displacement step D_c a/(b - a) depends equally on a and on b - a. The stress drop depends
almost only on b - a. The recurrence interval is the stress drop divided by k V_0, so it depends on
b - a and on k. First-order and total indices are equal, so the parameters do not interact. Error
bars in the figure show 95 % confidence intervals.
"""

import math
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np
import xarray as xr
from scipy.stats import norm

from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.measures import (
    CriticalStep,
    LimitCycle,
    Measure,
    Outcome,
    Output,
    OutputValue,
    Status,
)
from rsfstudy.motion import Integrator
from rsfstudy.reductions import Logarithm, SobolIndices
from rsfstudy.study.figure_declarations import MatplotlibAxes

#: Means of the independent parameters, each with an uncertainty of 10 %. The stiffness is the
#: stiffness of the limit cycles.
INPUT_MEANS = {"ln_a": 0.01, "ln_net": 0.02, "ln_stiffness": 0.006}
RELATIVE_UNCERTAINTY = 0.1
SOBOL_POINTS = 128
#: Outputs whose Sobol indices are computed. The keys are the prefixes of the indices.
INDEXED_OUTPUTS = {
    "displacement": "critical_displacement",
    "drop": "static_stress_drop",
    "interval": "recurrence_interval",
}
_STEP_MEASURE, _CYCLE_MEASURE = CriticalStep("displacement_step"), LimitCycle(phases=2)


@dataclass(frozen=True)
class Headlines(Measure):
    """Critical displacement, stress drop and recurrence interval of a scene.

    The critical displacement step is computed at the critical stiffness, where it equals D_c a/(b -
    a). Stress drop and recurrence interval are computed for the limit cycle at the stiffness of the
    scene.
    """

    name: ClassVar[str] = "headlines"
    primary_output = "critical_displacement"
    typical_rhs_evaluations = (
        _STEP_MEASURE.typical_rhs_evaluations + _CYCLE_MEASURE.typical_rhs_evaluations
    )
    outputs = tuple(Output(name, error=True) for name in INDEXED_OUTPUTS.values())
    needs_time: ClassVar[tuple[bool, ...]] = (False, True)

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the critical displacement and the limit cycle.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Outcome of the measure. If one of the computations fails, the outcome has the status and
            message of the failed computation.
        """
        at_critical = scene.without_mass().with_(stiffness_ratio=1.0)
        values: dict[str, OutputValue] = {}
        for measure, asked in ((_STEP_MEASURE, at_critical), (_CYCLE_MEASURE, scene)):
            outcome = measure.run_nested(asked, integrator)
            if outcome.status is not Status.OK:
                return Outcome(outcome.status, values, outcome.message)
            values |= {n: v for n, v in outcome.values.items() if n in self.variables}
        return Outcome(Status.OK, values)


def interval_claim(name: str, order: str, end: str) -> Claim:
    """Return the claim that a confidence interval begins below, or ends above, 1/2 (W1).

    Parameters
    ----------
    name : str
        Name of the parameter.
    order : str
        Order of the index: "first_order" or "total".
    end : str
        End of the interval: "low" or "high".

    Returns
    -------
    Claim
        Claim about one end of the confidence interval.
    """
    where = "begins below" if end == "low" else "ends above"
    return Claim(
        id="W1",
        statement=f"displacement: confidence interval of the {order} index of {name} {where} 1/2",
        source="ln(D_c a/(b - a)), a difference of two logarithms of equal variance",
        variable=f"displacement_{order}_ci_{end}",
        where={"input": name},
        relation="below" if end == "low" else "above",
        published=0.5,
        reason="a 95 % confidence interval",
    )


def first_order_claim(of: str, name: str, share: float) -> Claim:
    """Return a claim about a total Sobol index of the limit cycle (W3).

    Parameters
    ----------
    of : str
        Prefix of the index: "drop" or "interval".
    name : str
        Name of the parameter.
    share : float
        Expected index.

    Returns
    -------
    Claim
        Claim about the total index.
    """
    return Claim(
        id="W3",
        statement=f"{of}: {name} explains {share:g} of the variance of its logarithm",
        source=(
            "the drop is 2 (b - a) sigma times a logarithm, and the interval is the drop over k V_0"
        ),
        variable=f"{of}_total",
        where={"input": name},
        published=share,
        tolerance=0.1,
        reason="the standard error of an index from 128 points is 0.06, and the logarithmic factor "
        "also depends on a, b - a and k",
    )


def plot_indices(of: str, dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw first-order and total indices with their confidence intervals.

    Parameters
    ----------
    of : str
        Prefix of the index.
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    from rsfstudy.plots import cycle_marker, cycle_style

    for number, (order, text) in enumerate((("first_order", "first order"), ("total", "total"))):
        found = [dataset[f"{of}_{order}{end}"].values for end in ("", "_ci_low", "_ci_high")]
        at = np.arange(len(found[0])) + 0.2 * number - 0.1
        bars = [np.maximum(found[0] - found[1], 0.0), np.maximum(found[2] - found[0], 0.0)]
        style = {
            "color": cycle_style(number)["color"],
            "marker": cycle_marker(number),
            "linestyle": "none",
        }
        axes.errorbar(at, found[0], yerr=bars, label=text, **style)
    axes.set_xticks(range(len(INPUT_MEANS)), ["$a$", "$b-a$", "$k$"])
    axes.set_xlim(-0.5, len(INPUT_MEANS) - 0.5)


TITLES = {
    "displacement": "Critical displacement, $k = k_{cr}$",
    "drop": "Static stress drop",
    "interval": "Recurrence interval",
}
figure = Figure(
    [
        Panel(
            overlays=[partial(plot_indices, of)],
            title=title,
            x_label="Uncertain by 10 %",
            y_label="Sobol index",
            y_limits=(-0.1, 1.3),
        )
        for of, title in TITLES.items()
    ],
    columns=3,
)

study = Study(
    name="what_matters",
    title="Sobol indices of three results for uncertain a, b - a and stiffness",
    summary=Study.caption(__doc__),
    base=Scene(normal_stress="constant", inertia=True, stiffness=0.006),
    axes=[
        Axis.samples(
            {
                name: norm(math.log(value), RELATIVE_UNCERTAINTY)
                for name, value in INPUT_MEANS.items()
            },
            SOBOL_POINTS,
            seed=37,
            method="saltelli",
            fields={
                "a": lambda drawn: np.exp(drawn["ln_a"]),
                "b_over_a": lambda drawn: 1.0 + np.exp(drawn["ln_net"] - drawn["ln_a"]),
                "stiffness": lambda drawn: np.exp(drawn["ln_stiffness"]),
            },
        )
    ],
    measure=Headlines(),
    accuracy=Accuracy(rtol=1e-6),
    reductions=[
        *(Logarithm(name=f"ln_{name}", of=of) for name, of in INDEXED_OUTPUTS.items()),
        *(SobolIndices(name=name, of=f"ln_{name}") for name in INDEXED_OUTPUTS),
    ],
    claims=[
        *(
            interval_claim(name, order, end)
            for order in ("first_order", "total")
            for name in ("ln_a", "ln_net")
            for end in ("low", "high")
        ),
        Claim(
            id="W2",
            statement=(
                "stiffness has no influence on the critical displacement at critical stiffness"
            ),
            source="D_c a/(b - a)",
            variable="displacement_total",
            where={"input": "ln_stiffness"},
            published=0.0,
            tolerance=1e-15,
            reason="rounding; the critical displacement is computed at the critical stiffness, so "
            "it does not depend on k",
        ),
        first_order_claim("drop", "ln_net", 1.0),
        first_order_claim("interval", "ln_net", 0.5),
        first_order_claim("interval", "ln_stiffness", 0.5),
    ],
    plot=figure,
    references=["Saltelli et al. (2010), Computer Physics Communications 181, 259-270"],
)
