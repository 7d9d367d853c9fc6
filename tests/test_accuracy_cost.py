"""What accuracy costs: the counts are honest, the references hold, and so does what a user is told
before a run.
"""

import math

import numpy as np
import pytest
import xarray as xr
from extended_precision import critical_velocity, slider

from rsfstudy import Scene, catalogue
from rsfstudy.core.accuracy import Accuracy
from rsfstudy.core.stepping import METHODS, Meter, steps
from rsfstudy.equations import quasi_static
from rsfstudy.errors import InvalidValue
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.measures.problem import Problem
from rsfstudy.measures.step_response import StepResponse
from rsfstudy.measures.work_precision import WorkPrecision
from rsfstudy.reduce import Cheapest, reduced
from rsfstudy.status import Status

SCENE = Scene(law="slowness", normal_stress="constant", load_velocity_ratio=20.0)
PEAK = 8.853655123157110332821499968933
PROBLEM = Problem(
    scene=SCENE,
    measure=StepResponse(peaks=2, phases=2),
    quantity="max_log10_slip_rate",
    answer=PEAK,
    source="conserved quantity",
)
CYCLE = Scene(normal_stress="constant", stiffness_ratio=0.8, load_velocity_ratio=2.0, inertia=True)


@pytest.mark.parametrize("method", sorted(METHODS))
def test_every_right_hand_side_is_counted(method, monkeypatch):
    """By the meter as by the equations themselves: Jacobians and interpolants included."""
    system, calls = quasi_static(SCENE, clock=False), []
    counted = type(system)(
        system.regime,
        system.unknowns,
        system.scales,
        lambda clock, state: (calls.append(clock), system.rate(clock, state))[1],
        system.point,
    )
    meter = Meter(10**6, {"quasi_static": method})
    for number, step in enumerate(steps(counted, [0.0, 0.0], 1e-6, meter)):
        step.state_at(0.5 * (step.start + step.end))
        if number == 20:
            break
    assert meter.spent == len(calls)
    assert meter.steps == 21
    assert (meter.jacobians > 0) == (method in ("Radau", "BDF"))


@pytest.mark.parametrize("method", sorted(METHODS))
def test_every_integrator_solves_a_cycle(method):
    """Right to a hundred times a loose tolerance: multistep methods keep less of it."""
    regimes = ("slow_manifold", "inertial")
    accuracy = Accuracy(1e-5, methods=tuple((regime, method) for regime in regimes))
    outcome = LimitCycle(phases=2)(CYCLE, accuracy)
    assert outcome.status is Status.OK
    assert outcome.values["recurrence_interval"] == pytest.approx(27.39031822963789, rel=1e-3)


def test_work_precision_measures_errors_and_marks_failures():
    measure = WorkPrecision(
        problems=(PROBLEM,), integrators=("DOP853", "RK23"), digits=(4, 8), repeats=1, budget=9_000
    )
    found = measure(SCENE, Accuracy()).values
    errors = found["measured_error"]
    assert errors[0, 1] < 1e-7
    assert errors[0, 0] < 1e-3
    assert found["run_failed"].tolist() == [[0.0, 0.0], [0.0, 1.0]]
    assert np.isnan(errors[1, 1])
    assert np.isnan(found["run_time"][1, 1])
    assert found["run_evaluations"][1, 1] > 9_000


def test_scenes_without_a_reference_are_refused():
    with pytest.raises(InvalidValue, match="has no known answer"):
        WorkPrecision(problems=(PROBLEM,))(SCENE.with_(load_velocity_ratio=3.0), Accuracy())
    with pytest.raises(InvalidValue, match="DOP85"):
        WorkPrecision(integrators=("DOP85",))


def runs(achieved, work) -> xr.Dataset:
    dims = ("integrator", "requested_digits")
    return xr.Dataset(
        {
            "achieved_digits": (dims, np.array(achieved, dtype=float)),
            "run_evaluations": (dims, np.array(work, dtype=float)),
            "run_time": (dims, np.array(work, dtype=float)),
            "status": ((), 0),
        },
        coords={"integrator": ["DOP853", "other"], "requested_digits": [3.0, 6.0, 9.0]},
    )


def test_the_cheapest_integrator_is_found_between_its_runs():
    """The default makes 10 of its 100 to 1000 between 4 and 8 digits: at 6, sqrt(100 1000)."""
    dataset = runs([[4, 8, 10], [2, 6, 7]], [[100, 1000, 5000], [10, 50, np.nan]])
    found = reduced(dataset, (Cheapest(name="c", of="achieved_digits", digits=(6.0, 9.0)),))
    assert found.c_integrator.values.tolist() == ["other", "DOP853"]
    assert float(found.c_default_work.sel(digits=6)) == pytest.approx(math.sqrt(1e5))
    assert float(found.c_ratio.sel(digits=6)) == pytest.approx(math.sqrt(1e5) / 50.0)
    assert float(found.c_ratio.sel(digits=9)) == 1.0


def test_digits_reached_by_luck_do_not_count():
    dataset = runs([[9, 5, 9], [1, 2, 3]], [[10, 100, 1000], [10, 100, 1000]])
    found = reduced(dataset, (Cheapest(name="c", of="achieved_digits", digits=(6.0,)),))
    assert float(found.c_default_work[0]) > 100.0


def test_a_reference_computed_anew():
    """One of those stored: critical velocity of a/(b-a) = 1, slip law, constant normal stress."""
    assert float(critical_velocity(slider(), 5e-4)) == pytest.approx(1.999949384410229, rel=1e-14)


@pytest.mark.parametrize(("name", "within"), [("critical_step", 0.15), ("limit_cycle", 0.4)])
def test_the_work_a_user_is_told_is_the_work_it_takes(name, within):
    """The table of cycles is that of another one."""
    problems = catalogue.load("accuracy_cost").measure.problems
    problem = next(p for p in problems if p.measure.name == name)
    measure = problem.measure
    typical = measure(problem.scene, Accuracy()).rhs_evaluations
    for rtol in (1e-4, 1e-6, 1e-9):
        taken = measure(problem.scene, Accuracy(rtol)).rhs_evaluations
        told = measure.expected_work(Accuracy(rtol)) / measure.typical_work
        assert told == pytest.approx(taken / typical, rel=within)
