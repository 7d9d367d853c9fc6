"""Steppers: a step of order eight against SciPy's, engines against one another, and what a stepper
owes the loop.
"""

from __future__ import annotations

import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import EACH_STEP
from scipy.integrate import DOP853, RK45, Radau, solve_ivp

from rsfstudy import Scene
from rsfstudy.motion import layout
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.columns import filling, unpacking
from rsfstudy.motion.course import along, follow
from rsfstudy.motion.engines import PYTHON, SCIPY
from rsfstudy.motion.loop import move_on
from rsfstudy.motion.meter import Halt, Meter
from rsfstudy.motion.steppers import Stepper, unrolled
from rsfstudy.motion.steppers.order_eight import OrderEight
from rsfstudy.motion.steppers.scipy import METHODS, SciPyStepper, _by_floats
from rsfstudy.motion.workspace import Workspace, size, workspace
from rsfstudy.slider.equations import Equations, between_ruptures, in_rupture, rigid
from rsfstudy.status import Status

SLOW = Scene(stiffness_ratio=1.5, load_velocity_ratio=1.5)
CYCLE = {"stiffness_ratio": 0.8, "load_velocity_ratio": 2.0, "inertia": True}
#: Systems of equations of one to five unknowns, each with a state somewhere within its domain.
SYSTEMS = [
    (rigid(Scene(), 2.0), (0.05,)),
    (between_ruptures(SLOW, clock=False), (0.01, 0.004)),
    (in_rupture(Scene(**CYCLE), clock=True), (0.2, 17.0, 0.19, 0.0)),
    (between_ruptures(Scene(fluid="dilatant", load_velocity_ratio=3.0), clock=True),
     (0.01, 0.004, 0.001, -0.01, 0.0)),
]  # fmt: skip


# ---- a step of order eight -----------------------------------------------------------------------


def weighted(weights, rates):
    """A sum in the order of the stages, without those that do not count."""
    total = 0.0
    for weight, rate in zip(weights, rates, strict=False):
        if weight != 0.0:
            total += float(weight) * rate
    return total


def plain_step(equations: Equations, y, length: float, tolerance: float):
    """Stages, unknowns at the end, and local error, by loops over the tableau of SciPy."""
    n, stages = range(len(y)), [equations.rates(y)]
    for s in range(1, DOP853.n_stages + 1):
        weights = DOP853.A[s, :s] if s < DOP853.n_stages else DOP853.B
        new = tuple(y[i] + length * weighted(weights, [k[i] for k in stages]) for i in n)
        stages.append(equations.rates(new))
    fifth = third = 0.0
    for i in n:
        rates = [k[i] for k in stages]
        allowed = tolerance * (equations.scales[i] + max(abs(y[i]), abs(new[i])))
        fifth += (weighted(DOP853.E5, rates) / allowed) ** 2
        third += (weighted(DOP853.E3, rates) / allowed) ** 2
    error = abs(length) * fifth / math.sqrt((fifth + 0.01 * third) * len(y))
    return stages, new, error


@pytest.mark.parametrize("length", [0.3, -0.02])
@pytest.mark.parametrize(("equations", "y"), SYSTEMS)
def test_the_unrolled_step_is_that_of_plain_loops_to_the_bit(equations, y, length):
    n, tolerance = len(y), 1e-6
    attempt = unrolled.attempt(equations.rate, n, unpacking(len(equations.p)))
    block = [math.nan] * (unrolled.SIZES + 2 * n)
    block[unrolled.LENGTH], block[unrolled.TOLERANCE] = length, tolerance
    block[unrolled.SIZES + n :] = equations.scales
    stages = [*equations.rates(y), *[math.nan] * (n * unrolled.STAGES)]
    attempt(y, stages, equations.p, block)
    by_loops, new, error = plain_step(equations, y, length, tolerance)
    assert stages == [rate for stage in by_loops for rate in stage]
    assert tuple(block[unrolled.SIZES : unrolled.SIZES + n]) == new
    assert block[unrolled.ERROR] == error
    assert error > 0.0


def scipy_solver(method, equations: Equations, y, tolerance: float, **options):
    """SciPy's integrator itself."""
    return method(
        lambda _clock, state: equations.rates(tuple(state.tolist())),
        0.0,
        np.array(y),
        math.copysign(math.inf, options.pop("direction", 1.0)),
        rtol=tolerance,
        atol=tolerance * np.array(equations.scales),
        **options,
    )


@pytest.mark.parametrize(("equations", "y"), SYSTEMS)
def test_a_step_is_scipys(equations, y):
    """A step that it accepts: it sums in another order, over stages of order one."""
    solver = scipy_solver(DOP853, equations, y, 1e-3, first_step=0.01)
    solver.step()
    assert solver.t == 0.01
    _stages, new, _error = plain_step(equations, y, 0.01, 1e-3)
    assert new == pytest.approx(solver.y, rel=1e-14, abs=1e-15)


def ends_of_steps(equations: Equations, y, by: str, steps: int, **options):
    """Clocks at the ends of steps, and the meter."""
    meter = Meter(10**5, engine=by)
    path = along(equations, y, 1e-3, meter, [EACH_STEP], **options)
    return [event.clock for event in itertools.islice(path, steps + 1)], meter


@pytest.mark.parametrize("backward", [False, True])
@pytest.mark.parametrize(
    ("equations", "y", "steps"), [(*SYSTEMS[1], 20), *((*s, 5) for s in SYSTEMS)]
)
def test_plain_python_takes_the_steps_of_scipy(equations, y, steps, backward):
    """Rounding is some 1e-13 of what decides the length of a step. A slider that weakens makes more
    of it, and one that has come to rest has no error but rounding: few steps there.
    """
    ours, theirs = (
        ends_of_steps(equations, y, by, steps, backward=backward) for by in (PYTHON, SCIPY)
    )
    assert ours[0] == pytest.approx(theirs[0], rel=1e-9)
    assert math.copysign(1.0, ours[0][-1]) == (-1.0 if backward else 1.0)
    assert abs(ours[1].spent - theirs[1].spent) <= 2
    assert ours[1].steps == theirs[1].steps == steps


# ---- what a stepper owes the loop ----------------------------------------------------------------


def begun(
    equations: Equations, y, tolerance: float, kind: type[Stepper], method: str = "DOP853"
) -> tuple[Stepper, SimpleNamespace, Workspace]:
    """A stepper that stands at the beginning of a path, with all that it knows of it."""
    stepper = kind((equations,), {equations.regime: method})
    n, states = len(y), equations.states
    given = {"tolerance": tolerance, "budget": 10**6, "direction": 1.0, "lasts": math.inf}
    motion = SimpleNamespace(**{**dict.fromkeys(layout.MOTION.names, 0), **given})
    arrays = (size(n, states, 0), 2 * n, n)
    block, unknowns, scales = (memoryview(np.zeros(numbers)) for numbers in arrays)
    unknowns[:n], scales[:] = np.array(y, dtype=float), np.array(equations.scales)
    functions = [*filling(equations)]
    others = memoryview(np.zeros(1)), 0, equations.p, equations.p, None, stepper
    space = workspace(block, unknowns, n, scales, states, functions, others)
    stepper.begin(motion, space)
    return stepper, motion, space


KINDS = [(OrderEight, "DOP853"), *((SciPyStepper, method) for method in sorted(METHODS))]


@pytest.mark.parametrize(("kind", "method"), KINDS)
@pytest.mark.parametrize("part", [1e-3, 0.4, 1.0])
def test_a_step_taken_anew_ends_at_the_clock_asked_for(kind, method, part):
    """To the bit, and there it is as right as a step: to a hundred times the tolerance."""
    equations, y = SYSTEMS[1]
    stepper, motion, space = begun(equations, y, 1e-6, kind, method)
    for number in range(6):
        if number:
            move_on(motion, space)
        assert stepper.attempt(motion, space, 1.0) == motion.end - motion.clock > 0.0
    began, start = motion.clock, tuple(space.y[:2])
    clock = began + part * (motion.end - began)
    stepper.retake(motion, space, clock)
    assert motion.clock == began
    assert motion.end == clock
    assert motion.taken == clock - began
    exact = solve_ivp(
        lambda _t, state: equations.rates(tuple(state)), (began, clock), start, "DOP853",
        rtol=1e-12, atol=1e-14,
    ).y[:, -1]  # fmt: skip
    new = tuple(space.new[:2])
    for ours, theirs, scale in zip(new, exact, equations.scales, strict=True):
        assert ours == pytest.approx(theirs, abs=1e-4 * scale)
    assert tuple(space.rates_at_end[:2]) == pytest.approx(equations.rates(new), rel=1e-12)
    # dense output of the step as it is now
    stepper.unknowns_at(motion, space, clock)
    assert tuple(space.within[:2]) == pytest.approx(new, rel=1e-12)
    stepper.unknowns_at(motion, space, began)
    assert tuple(space.within[:2]) == pytest.approx(start, rel=1e-12)


@pytest.mark.parametrize("method", [DOP853, RK45, Radau])
def test_values_within_a_step_are_those_of_scipy(method):
    """Dense output of order eight is read on floats: operation by operation what SciPy does."""

    def rate(_t, y):
        return np.array([y[1], -y[0] * y[0], np.cos(y[2])])

    solver = method(rate, 0.0, np.array([1.0, 0.3, -2.0]), 10.0, rtol=1e-6)
    solver.step()
    dense = solver.dense_output()
    for clock in np.linspace(solver.t_old, solver.t, 7).tolist():
        assert list(_by_floats(dense)(clock)) == pytest.approx(dense(clock).tolist(), rel=1e-14)


@pytest.mark.parametrize("method", sorted(METHODS))
def test_a_budget_ends_within_a_step(method):
    """LSODA may go on for ever within one; what follows is not disturbed."""
    regime = SYSTEMS[1][0].regime
    for budget in range(21, 30):
        meter = Meter(budget, {regime: method})
        with pytest.raises(Halt) as halt:
            list(follow(SLOW, Accuracy(1e-6, budget), meter))
        assert halt.value.status is Status.WORK_BUDGET_SPENT
        # the rates at the end of a step belong to it, whoever computes them
        assert budget < meter.spent <= budget + 2
    ends = []
    for by in (method, "DOP853"):
        *_, end = follow(SLOW, Accuracy(1e-6), Meter(10**5, {regime: by}), until=8.0)
        ends.append(end.point.log_slip_rate)
    # multistep methods keep less of a tolerance
    assert ends[0] == pytest.approx(ends[1], abs=1e-4)
