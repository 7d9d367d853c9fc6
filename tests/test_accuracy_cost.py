"""Tests of the study of accuracy and cost.

The tests compare the counted work with the actual work, repeat a reference value, and check
the work estimate that users see before a run.
"""

import itertools
import math

import numpy as np
import pytest
import xarray as xr
from extended_precision import critical_velocity, make_slider
from motion_helpers import STEP_END_EVENT
from rsfstudy.named_studies._cheapest_integrator import CheapestIntegrator
from rsfstudy.named_studies._known_problems import Problem
from rsfstudy.named_studies.accuracy_cost import WorkPrecision

from rsfstudy import Scene
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.measures import Outcome
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.integrator import Integrator
from rsfstudy.motion.recording import MotionRecorder
from rsfstudy.motion.steppers.scipy import SCIPY_SOLVER_BY_METHOD_NAME
from rsfstudy.reductions import apply_reductions
from rsfstudy.responses.step_response import StepResponse
from rsfstudy.slider.equations import build_equations_between_ruptures
from rsfstudy.status import Status
from rsfstudy.study import study_loader

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


@pytest.mark.parametrize("method", sorted(SCIPY_SOLVER_BY_METHOD_NAME))
def test_every_right_hand_side_is_counted(method, monkeypatch):
    """The integrator and the equations count the same number of evaluations.

    The count includes evaluations for Jacobians and interpolants.
    """
    system, calls = build_equations_between_ruptures(SCENE, with_time=False), []
    counted = system._replace(
        rate_function=lambda state, p: (calls.append(state), system.rate_function(state, p))[1]
    )
    integrator = Integrator(Accuracy(budget=10**6, methods=(("quasi_static", method),)))
    # The recording needs interpolants within each step.
    path = integrator.follow_equations(
        counted, (0.0, 0.0), [STEP_END_EVENT], local_tolerance=1e-6, recording=MotionRecorder()
    )
    told = list(itertools.islice(path, 22))
    assert integrator.evaluations == told[-1].evaluation_count == len(calls)
    assert integrator.work_meter.step_count == 21
    assert (integrator.work_meter.jacobian_evaluations > 0) == (method in ("Radau", "BDF"))


@pytest.mark.parametrize("method", sorted(SCIPY_SOLVER_BY_METHOD_NAME))
def test_every_integrator_solves_a_cycle(method):
    """Each integrator agrees to 100 times the loose tolerance.

    Multistep methods lose more of the requested accuracy than other methods.
    """
    regimes = ("slow_manifold", "inertial")
    accuracy = Accuracy(1e-5, methods=tuple((regime, method) for regime in regimes))
    outcome = LimitCycle(phases=2)(CYCLE, accuracy)
    assert outcome.status is Status.OK
    assert outcome.values["recurrence_interval"] == pytest.approx(27.39031822963789, rel=1e-3)


def solved(integrator: str, digits: float, **fields) -> Outcome:
    measure = WorkPrecision((PROBLEM,), integrator, digits, **{"run_budget": 9_000, **fields})
    return measure(SCENE, Accuracy())


def test_work_precision_measures_errors():
    loose, tight = solved("DOP853", 4.0), solved("DOP853", 8.0)
    assert loose.status is tight.status is Status.OK
    assert tight.values["measured_error"] < 1e-7 < loose.values["measured_error"] < 1e-3
    assert loose.values["run_evaluations"] == loose.rhs_evaluations < tight.rhs_evaluations
    assert solved("RK23", 4.0).rhs_evaluations > loose.rhs_evaluations


def test_an_accuracy_out_of_reach_is_an_answer():
    """The outcome contains the work, but no time, because no run succeeded."""
    found = solved("RK23", 8.0)
    assert found.status is Status.ACCURACY_OUT_OF_REACH
    assert found.status.is_answer
    assert found.message.startswith("work_budget_spent: the budget of 9000")
    assert found.values["run_evaluations"] == found.rhs_evaluations > 9_000
    assert not {"run_time", "relative_time", "measured_error"} & set(found.values)


@pytest.mark.parametrize("integrator", ["DOP853 + Radau", "DOP853 + LSODA"])
def test_what_is_for_mass_does_not_apply_without_it(integrator):
    found = solved(integrator, 4.0)
    assert found.status is Status.NOT_APPLICABLE
    assert found.status.is_answer
    assert found.rhs_evaluations == 0


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
    """The work is interpolated in logarithms between the runs.

    The default integrator needs 100 to 1000 evaluations for 4 to 8 digits, so 6 digits need
    sqrt(100 x 1000).
    """
    dataset = runs([[4, 8, 10], [2, 6, 7]], [[100, 1000, 5000], [10, 50, np.nan]])
    found = apply_reductions(
        dataset, (CheapestIntegrator(name="c", of="achieved_digits", digits=(6.0, 9.0)),)
    )
    assert found.c_integrator.values.tolist() == ["other", "DOP853"]
    assert float(found.c_default_work.sel(digits=6)) == pytest.approx(math.sqrt(1e5))
    assert float(found.c_ratio.sel(digits=6)) == pytest.approx(math.sqrt(1e5) / 50.0)
    assert float(found.c_ratio.sel(digits=9)) == 1.0


def test_digits_reached_by_luck_do_not_count():
    dataset = runs([[9, 5, 9], [1, 2, 3]], [[10, 100, 1000], [10, 100, 1000]])
    found = apply_reductions(
        dataset, (CheapestIntegrator(name="c", of="achieved_digits", digits=(6.0,)),)
    )
    assert float(found.c_default_work[0]) > 100.0


def test_a_reference_computed_anew():
    """The stored reference value is reproduced with extended precision.

    The value is the critical velocity for a/(b-a) = 1, the slip law and constant normal
    stress.
    """
    assert float(critical_velocity(make_slider(), 5e-4)) == pytest.approx(
        1.999949384410229, rel=1e-14
    )


@pytest.mark.parametrize(("name", "within"), [("critical_step", 0.15), ("limit_cycle", 0.4)])
def test_the_work_a_user_is_told_is_the_work_it_takes(name, within):
    """The estimate agrees with the actual work within the given fraction.

    The estimate for cycles was calibrated with another cycle.
    """
    problems = study_loader.load_study("accuracy_cost").measure.problems
    problem = next(p for p in problems if p.measure.name == name)
    measure = problem.measure
    typical = measure(problem.scene, Accuracy()).rhs_evaluations
    for rtol in (1e-4, 1e-6, 1e-9):
        taken = measure(problem.scene, Accuracy(rtol)).rhs_evaluations
        told = measure.expected_work(Accuracy(rtol)) / measure.typical_rhs_evaluations
        assert told == pytest.approx(taken / typical, rel=within)
