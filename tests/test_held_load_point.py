"""Tests of critical steps with a held load point and several states.

Several states may weaken one after another.
"""

import math

import numpy as np
import pytest
from motion_helpers import reaches_instability_norm

from rsfstudy import Scene, simulate
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.critical_steps.triggered_instability import Triggered
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED
from rsfstudy.motion.integration_events import fall, maximum
from rsfstudy.motion.integrator import Integrator
from rsfstudy.status import Status

DISPLACEMENT, FALL = "displacement_step", "normal_stress_step"
CONSTANT = {"normal_stress": "constant"}

#: Scenes whose first peak is not the last peak: two states, one of which has b < 0, and a
#: dilatant fault whose pressure recovers.
LATE = [
    (
        DISPLACEMENT,
        "up",
        {"law": "two_slip_states", **CONSTANT, "a": 0.01, "b1_over_a": 2.8, "b2_over_a": -0.8,
         "length_ratio": 0.15, "stiffness_ratio": 1.5},
    ),
    (
        FALL,
        "down",
        {"law": "slowness", "normal_stress": "variable", "alpha": 0.0, "phi": 46.0,
         "mu_star": 0.66, "a": 0.007, "b_over_a": 1.17, "fluid": "dilatant", "dilatancy": 0.011,
         "drainage": 30.0, "stiffness_ratio": 1.0, "period": 300.0, "reference_rate": 2.6e-8},
    ),
]  # fmt: skip


@pytest.mark.parametrize("engine", ["scipy", COMPILED])
@pytest.mark.parametrize(("of", "direction", "fields"), LATE)
def test_the_first_peak_of_several_states_is_not_the_last(of, direction, fields, engine):
    scene = Scene(**fields)
    outcome = CriticalStep(of=of, direction=direction)(scene, Accuracy(1e-5, engine=engine))
    assert outcome.status is Status.OK
    stepped = scene.with_(load_velocity_ratio=0.0)
    critical = outcome.values[CriticalStep(of=of).primary_output]
    for share, reaches in ((0.25, False), (0.9, False), (0.9999, False), (1.0001, True)):
        at = stepped.with_(**{of: share * critical})
        assert reaches_instability_norm(at) is reaches
        triggered = Triggered()(at, Accuracy(1e-5, engine=engine))
        assert triggered.values["unstable"] == reaches


def random_scene(draw: np.random.Generator, number: int) -> tuple[str, str, dict[str, object]]:
    """Return a step type, its direction and the fields of a random scene.

    The scene has several states.
    """
    fields = {
        "a": 10 ** draw.uniform(-2.5, -1.7),
        "mu_star": draw.uniform(0.4, 0.8),
        "stiffness_ratio": draw.uniform(0.7, 3.0),
        "period": 10 ** draw.uniform(-1.0, 2.5),
        "reference_rate": 10 ** draw.uniform(-9.0, -6.0),
    }
    fall_of_stress = number % 4 == 3
    if fall_of_stress or number % 2:
        fields |= {"normal_stress": "imposed", "alpha": draw.uniform(0.0, 0.4)}
    else:
        fields |= CONSTANT
    if number % 3 == 2:
        law = ("slip", "slowness")[number % 2]
        fields |= {"law": law, "b_over_a": draw.uniform(1.1, 3.0), "fluid": "dilatant"}
        fields |= {"dilatancy": 10 ** draw.uniform(-4.0, -1.7)}
        fields |= {"drainage": 10 ** draw.uniform(-3.0, 3.0)}
    else:
        law = ("two_slip_states", "two_slowness_states")[number % 2]
        fields |= {"law": law, "length_ratio": 10 ** draw.uniform(-1.0, 1.0)}
        fields |= {"b1_over_a": draw.uniform(1.3, 3.0), "b2_over_a": draw.uniform(-0.9, 0.9)}
    return (FALL, "down", fields) if fall_of_stress else (DISPLACEMENT, "up", fields)


# The motions end early if the slip rate grows without bound, or if drainage limits the steps.
@pytest.mark.filterwarnings("ignore::rsfstudy.errors.IncompleteWarning")
@pytest.mark.filterwarnings("ignore::rsfstudy.errors.NoResultWarning")
@pytest.mark.parametrize("number", range(12))
def test_no_smaller_step_runs_away(number):
    """Only steps above the critical step reach the norm.

    The random scenes are simulated without early termination.
    """
    of, direction, fields = random_scene(np.random.default_rng([20, number]), number)
    measure = CriticalStep(of=of, direction=direction)
    scene = Scene(**fields)
    outcome = measure(scene, Accuracy(1e-4, engine=COMPILED))
    stepped = scene.with_(load_velocity_ratio=0.0)
    assert outcome.status is Status.OK
    critical = outcome.values[measure.primary_output]
    for share in (0.25, 0.5, 0.8, 0.97, 1.02):
        at = stepped.with_(**{of: share * critical})
        motion = simulate(at, duration=1e4, rtol=1e-6, budget=20_000, engine=COMPILED)
        highest = math.log(10.0) * motion.log10_slip_rate.max()
        assert (highest >= scene.log_slip_rate_at_instability) == (share > 1.0)


@pytest.mark.parametrize("law", ["slip", "slowness"])
@pytest.mark.parametrize("drainage", [0.01, 1.0, 100.0])
@pytest.mark.parametrize(("dilatancy", "length"), [(0.01, 1.0), (0.01, 0.1), (-0.01, 3.0)])
def test_pore_pressure_stays_below_its_bound(law, drainage, dilatancy, length):
    """The pore pressure stays below the bound of the fluid.

    If drainage is fast and porosity follows the slip rate, the pressure approaches the bound.
    """
    scene = Scene(law=law, **CONSTANT, fluid="dilatant", drainage=drainage, dilatancy=dilatancy,
                  porosity_length=length, stiffness_ratio=2.0, displacement_step=0.5,
                  load_velocity_ratio=0.0)  # fmt: skip
    points = [
        event.point
        for event in Integrator(Accuracy(1e-6, 20_000, engine=COMPILED)).follow(
            scene,
            (
                maximum("log_slip_rate"),
                *(fall("log_slip_rate", -float(x), terminal=x == 4) for x in range(5)),
            ),
        )
    ]
    assert len(points) > 4
    bound = scene.parts.fluid.compute_pore_pressure_upper_bound
    for now, point in enumerate(points):
        to_come = points[now:]
        highest = max(later.log_slip_rate for later in to_come)
        told = bound(highest, point.psis[1:])
        assert max(later.psis[-1] for later in to_come) <= told * (1.0 + 1e-6)
    # Finally, the slip rate decreases slowly compared with drainage, and the pressure is in
    # equilibrium.
    last = points[-1]
    if drainage > 10.0 and length == 1.0:
        assert bound(last.log_slip_rate, last.psis[1:]) == pytest.approx(last.psis[-1], rel=0.05)


@pytest.mark.parametrize("stiffness_ratio", [1e3, 1e6])
@pytest.mark.parametrize("of", ["load_velocity_ratio", DISPLACEMENT])
@pytest.mark.parametrize("direction", ["up", "down"])
def test_springs_far_stiffer_than_critical_end_in_a_status(stiffness_ratio, of, direction):
    """Extremely stiff springs produce a result or a status.

    A stiff slider follows the load point, so a displacement step is critical if its jump
    reaches the norm. The closed form for k = k_cr overflows.
    """
    scene = Scene(**CONSTANT, stiffness_ratio=stiffness_ratio)
    measure = CriticalStep(of=of, direction=direction)
    outcome = measure(scene, Accuracy(1e-4, budget=3_000, engine=COMPILED))
    if of == DISPLACEMENT and direction == "up":
        jump = scene.a * scene.log_slip_rate_at_instability / scene.stiffness
        assert outcome.values["critical_displacement"] == pytest.approx(jump, rel=1e-8)
        assert outcome.values["slip_rate_after_closed_form_step"] == math.inf
    else:
        assert outcome.status in (Status.STABLE_FOR_ALL_STEPS, Status.WORK_BUDGET_SPENT)
