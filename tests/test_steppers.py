"""Tests of steppers.

A step of order eight is compared with SciPy, the engines are compared with each other, and
each stepper must meet the requirements of the loop.
"""

from __future__ import annotations

import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest
from motion_helpers import STEP_END_EVENT
from scipy.integrate import DOP853, RK45, Radau, solve_ivp

from rsfstudy import Scene
from rsfstudy.motion import array_layout
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import PYTHON, SCIPY
from rsfstudy.motion.in_place_functions import (
    build_array_unpacking_function,
    build_in_place_functions,
)
from rsfstudy.motion.integrator import Integrator
from rsfstudy.motion.motion_loop import move_step_begin_to_step_end
from rsfstudy.motion.steppers import Stepper, unrolled_runge_kutta_step
from rsfstudy.motion.steppers.order_eight import OrderEightStepper
from rsfstudy.motion.steppers.scipy import (
    SCIPY_SOLVER_BY_METHOD_NAME,
    SciPyStepper,
    _build_interpolant_of_unknowns,
)
from rsfstudy.motion.work_meter import MotionStopped
from rsfstudy.motion.workspace import Workspace, compute_workspace_size, create_workspace
from rsfstudy.slider.equations import (
    EquationsOfMotion,
    build_equations_at_imposed_slip_rate,
    build_equations_between_ruptures,
    build_equations_in_rupture,
)
from rsfstudy.status import Status

SLOW = Scene(stiffness_ratio=1.5, load_velocity_ratio=1.5)
CYCLE = {"stiffness_ratio": 0.8, "load_velocity_ratio": 2.0, "inertia": True}
DILATANT = Scene(fluid="dilatant", load_velocity_ratio=3.0)
#: Systems of one to five equations, each with a state inside its domain.
SYSTEMS = [
    (build_equations_at_imposed_slip_rate(Scene(), 2.0), (0.05,)),
    (build_equations_between_ruptures(SLOW, with_time=False), (0.01, 0.004)),
    (build_equations_in_rupture(Scene(**CYCLE), with_time=True), (0.2, 17.0, 0.19, 0.0)),
    (build_equations_between_ruptures(DILATANT, with_time=True), (0.01, 0.004, 0.001, -0.01, 0.0)),
]  # fmt: skip


# ---- a step of order eight -----------------------------------------------------------------------
def weighted(weights, rates):
    """Return a weighted sum in the order of the stages.

    Terms with zero weight are omitted.
    """
    total = 0.0
    for weight, rate in zip(weights, rates, strict=False):
        if weight != 0.0:
            total += float(weight) * rate
    return total


def plain_step(equations: EquationsOfMotion, y, length: float, tolerance: float):
    """Return stages, new unknowns and local error of a step.

    The function uses loops over the tableau of SciPy.
    """
    n, stages = range(len(y)), [equations.evaluate_rates(y)]
    for s in range(1, DOP853.n_stages + 1):
        weights = DOP853.A[s, :s] if s < DOP853.n_stages else DOP853.B
        new = tuple(y[i] + length * weighted(weights, [k[i] for k in stages]) for i in n)
        stages.append(equations.evaluate_rates(new))
    fifth = third = 0.0
    for i in n:
        rates = [k[i] for k in stages]
        allowed = tolerance * (equations.unknown_scales[i] + max(abs(y[i]), abs(new[i])))
        fifth += (weighted(DOP853.E5, rates) / allowed) ** 2
        third += (weighted(DOP853.E3, rates) / allowed) ** 2
    error = abs(length) * fifth / math.sqrt((fifth + 0.01 * third) * len(y))
    return stages, new, error


@pytest.mark.parametrize("length", [0.3, -0.02])
@pytest.mark.parametrize(("equations", "y"), SYSTEMS)
def test_the_unrolled_step_is_that_of_plain_loops_to_the_bit(equations, y, length):
    n, tolerance = len(y), 1e-6
    attempt = unrolled_runge_kutta_step.build_step_attempt_function(
        equations.rate_function, n, build_array_unpacking_function(len(equations.parameters))
    )
    block = [math.nan] * (unrolled_runge_kutta_step.HEADER_SIZE + 2 * n)
    (
        block[unrolled_runge_kutta_step.LENGTH_INDEX],
        block[unrolled_runge_kutta_step.TOLERANCE_INDEX],
    ) = length, tolerance
    block[unrolled_runge_kutta_step.HEADER_SIZE + n :] = equations.unknown_scales
    stages = [
        *equations.evaluate_rates(y),
        *[math.nan] * (n * unrolled_runge_kutta_step.STAGE_COUNT),
    ]
    attempt(y, stages, equations.parameters, block)
    by_loops, new, error = plain_step(equations, y, length, tolerance)
    assert stages == [rate for stage in by_loops for rate in stage]
    assert (
        tuple(
            block[unrolled_runge_kutta_step.HEADER_SIZE : unrolled_runge_kutta_step.HEADER_SIZE + n]
        )
        == new
    )
    assert block[unrolled_runge_kutta_step.ERROR_INDEX] == error
    assert error > 0.0


def scipy_solver(method, equations: EquationsOfMotion, y, tolerance: float, **options):
    """Return a solver of SciPy for the equations."""
    return method(
        lambda _clock, state: equations.evaluate_rates(tuple(state.tolist())),
        0.0,
        np.array(y),
        math.copysign(math.inf, options.pop("direction", 1.0)),
        rtol=tolerance,
        atol=tolerance * np.array(equations.unknown_scales),
        **options,
    )


@pytest.mark.parametrize(("equations", "y"), SYSTEMS)
def test_a_step_is_scipys(equations, y):
    """An accepted step agrees with SciPy to rounding error.

    The order of the sums differs, and the stages are of order one.
    """
    solver = scipy_solver(DOP853, equations, y, 1e-3, first_step=0.01)
    solver.step()
    assert solver.t == 0.01
    _stages, new, _error = plain_step(equations, y, 0.01, 1e-3)
    assert new == pytest.approx(solver.y, rel=1e-14, abs=1e-15)


def ends_of_steps(equations: EquationsOfMotion, y, by: str, steps: int, **options):
    """Return the independent variable at the end of each step.

    The second return value is the integrator.
    """
    integrator = Integrator(Accuracy(budget=10**5, engine=by))
    path = integrator.follow_equations(
        equations, y, [STEP_END_EVENT], local_tolerance=1e-3, **options
    )
    return [event.independent_variable for event in itertools.islice(path, steps + 1)], integrator


@pytest.mark.parametrize("backward", [False, True])
@pytest.mark.parametrize(
    ("equations", "y", "steps"), [(*SYSTEMS[1], 20), *((*s, 5) for s in SYSTEMS)]
)
def test_plain_python_takes_the_steps_of_scipy(equations, y, steps, backward):
    """The engine ``python`` takes the same steps as SciPy.

    The rounding error of the step size is about 1e-13. A weakening slider amplifies it, and
    the error estimate of a slider at rest consists of rounding errors only, so only a few
    steps are compared.
    """
    ours, theirs = (
        ends_of_steps(equations, y, by, steps, backward=backward) for by in (PYTHON, SCIPY)
    )
    assert ours[0] == pytest.approx(theirs[0], rel=1e-9)
    assert math.copysign(1.0, ours[0][-1]) == (-1.0 if backward else 1.0)
    assert abs(ours[1].evaluations - theirs[1].evaluations) <= 2
    assert ours[1].work_meter.step_count == theirs[1].work_meter.step_count == steps


# ---- what a stepper owes the loop ----------------------------------------------------------------
def begun(
    equations: EquationsOfMotion, y, tolerance: float, kind: type[Stepper], method: str = "DOP853"
) -> tuple[Stepper, SimpleNamespace, Workspace]:
    """Return a stepper at the start of a path, with motion and workspace."""
    stepper = kind((equations,), {equations.regime_name: method})
    n, states = len(y), equations.state_count
    given = {"tolerance": tolerance, "budget": 10**6, "direction": 1.0, "end_time": math.inf}
    motion = SimpleNamespace(**{**dict.fromkeys(array_layout.MOTION_STATE_DTYPE.names, 0), **given})
    arrays = (compute_workspace_size(n, states, 0), 2 * n, n)
    block, unknowns, scales = (memoryview(np.zeros(numbers)) for numbers in arrays)
    unknowns[:n], scales[:] = np.array(y, dtype=float), np.array(equations.unknown_scales)
    functions = [*build_in_place_functions(equations)]
    others = memoryview(np.zeros(1)), 0, equations.parameters, equations.parameters, None, stepper
    space = create_workspace(block, unknowns, n, scales, states, functions, others)
    stepper.begin_regime(motion, space)
    return stepper, motion, space


KINDS = [
    (OrderEightStepper, "DOP853"),
    *((SciPyStepper, method) for method in sorted(SCIPY_SOLVER_BY_METHOD_NAME)),
]


@pytest.mark.parametrize(("kind", "method"), KINDS)
@pytest.mark.parametrize("part", [1e-3, 0.4, 1.0])
def test_a_step_taken_anew_ends_at_the_clock_asked_for(kind, method, part):
    """A truncated step ends exactly at the requested value.

    The result has an error of at most 100 times the tolerance, as other steps.
    """
    equations, y = SYSTEMS[1]
    stepper, motion, space = begun(equations, y, 1e-6, kind, method)
    for number in range(6):
        if number:
            move_step_begin_to_step_end(motion, space)
        assert stepper.attempt_step(motion, space, 1.0) == motion.end - motion.clock > 0.0
    began, start = motion.clock, tuple(space.y[:2])
    clock = began + part * (motion.end - began)
    stepper.retake_step(motion, space, clock)
    assert motion.clock == began
    assert motion.end == clock
    assert motion.step_length == clock - began
    exact = solve_ivp(
        lambda _t, state: equations.evaluate_rates(tuple(state)), (began, clock), start, "DOP853",
        rtol=1e-12, atol=1e-14,
    ).y[:, -1]  # fmt: skip
    new = tuple(space.y_end[:2])
    for ours, theirs, scale in zip(new, exact, equations.unknown_scales, strict=True):
        assert ours == pytest.approx(theirs, abs=1e-4 * scale)
    assert tuple(space.rates_at_end[:2]) == pytest.approx(equations.evaluate_rates(new), rel=1e-12)
    # Dense output of the truncated step.
    stepper.interpolate_unknowns(motion, space, clock)
    assert tuple(space.y_within[:2]) == pytest.approx(new, rel=1e-12)
    stepper.interpolate_unknowns(motion, space, began)
    assert tuple(space.y_within[:2]) == pytest.approx(start, rel=1e-12)


@pytest.mark.parametrize("method", [DOP853, RK45, Radau])
def test_values_within_a_step_are_those_of_scipy(method):
    """Dense output on floats agrees with SciPy to rounding error."""

    def rate(_t, y):
        return np.array([y[1], -y[0] * y[0], np.cos(y[2])])

    solver = method(rate, 0.0, np.array([1.0, 0.3, -2.0]), 10.0, rtol=1e-6)
    solver.step()
    dense = solver.dense_output()
    for clock in np.linspace(solver.t_old, solver.t, 7).tolist():
        assert list(_build_interpolant_of_unknowns(dense)(clock)) == pytest.approx(
            dense(clock).tolist(), rel=1e-14
        )


@pytest.mark.parametrize("method", sorted(SCIPY_SOLVER_BY_METHOD_NAME))
def test_a_budget_ends_within_a_step(method):
    """The work budget is checked within each step.

    LSODA may continue for ever within one step. Later motions are not affected.
    """
    regime = SYSTEMS[1][0].regime_name
    for budget in range(21, 30):
        integrator = Integrator(Accuracy(1e-6, budget, methods=((regime, method),)))
        with pytest.raises(MotionStopped) as halt:
            list(integrator.follow(SLOW))
        assert halt.value.status is Status.WORK_BUDGET_SPENT
        # The rates at the end of a step belong to the step.
        assert budget < integrator.evaluations <= budget + 2
    ends = []
    for by in (method, "DOP853"):
        *_, end = Integrator(Accuracy(1e-6, 10**5, methods=((regime, by),))).follow(SLOW, until=8.0)
        ends.append(end.point.log_slip_rate)
    # Multistep methods lose more of the requested accuracy.
    assert ends[0] == pytest.approx(ends[1], abs=1e-4)
