"""What is recorded between steps is as accurate as their ends, and so are orbits along a phase."""

import numpy as np
import pytest

from rsfstudy import Scene, simulate
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.measures.step_response import StepResponse
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.course import follow
from rsfstudy.motion.engines import COMPILED, ENGINES
from rsfstudy.motion.meter import Meter
from rsfstudy.motion.recording import READ, Recording
from rsfstudy.status import Status

#: What values may be off by, in the accuracy asked for, times what weighs as much as 1 in ln V.
ALLOWED = 30.0


def weights(scene: Scene) -> dict[str, float]:
    """What weighs as much as 1 in ln V."""
    stresses = ("shear_stress", "frictional_stress", "state_variable")
    return {"log10_slip_rate": np.log10(np.e), "slip": 1.0} | dict.fromkeys(stresses, scene.a)


def exactly(scene: Scene, times: np.ndarray) -> dict[str, np.ndarray]:
    """The motion at times, a hundred times more accurate than any below."""
    recording, accuracy = Recording(at=times), Accuracy(1e-11, 10**7, engine=COMPILED)
    meter = Meter(10**7, engine=COMPILED)
    list(follow(scene, accuracy, meter, until=float(times[-1]), recording=recording))
    return dict(zip(READ, recording.seen(scene).T, strict=False))


@pytest.mark.parametrize("rtol", [1e-4, 1e-9])
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("stiff", [3.0, 17.0])
def test_rows_between_the_steps_of_a_stiff_slider(stiff, engine, rtol):
    """Stability limits its steps, and dense output was off by 720 times the accuracy."""
    scene = Scene(normal_stress="constant", stiffness_ratio=stiff, load_velocity_ratio=10.0)
    rows = simulate(scene, duration=3.0, rtol=rtol, engine=engine)
    exact = exactly(scene, rows.time.values)
    for name, weight in weights(scene).items():
        off = np.abs(rows[name].values - exact[name]).max() / weight
        assert off < ALLOWED * rtol, name


@pytest.mark.parametrize("law", ["slip", "slowness"])
def test_points_along_a_response_are_those_of_the_motion(law):
    """Between rows, not on straight lines through them: those were off by 1e-3."""
    scene, rtol = Scene(law=law, stiffness_ratio=1.1, load_velocity_ratio=1.3), 1e-7
    found = StepResponse(phases=150)(scene, Accuracy(rtol, engine=COMPILED))
    assert found.status is Status.OK
    times = found.values["time"]
    assert (np.diff(times) >= 0.0).all()
    exact = exactly(scene, times)
    for name, weight in weights(scene).items():
        off = np.abs(found.values[name] - exact[name]).max() / weight
        assert off < ALLOWED * rtol, name


@pytest.mark.parametrize("fields", [{"inertia": True}, {"radiation_damping": 1e-6}])
@pytest.mark.parametrize("law", ["slip", "slowness"])
def test_the_extremes_of_a_cycle_are_points_of_its_orbit(law, fields):
    """Within what errors of the headline are told."""
    scene = Scene(law=law, stiffness_ratio=0.8, load_velocity_ratio=2.0, **fields)
    found = LimitCycle(phases=80)(scene, Accuracy(1e-6, engine=COMPILED)).values
    orbit, stress = found["log10_slip_rate"], found["shear_stress"]
    for name, extreme in (
        ("max_log10_slip_rate", orbit.max()),
        ("min_log10_slip_rate", orbit.min()),
        ("static_stress_drop", np.ptp(stress)),
        ("dynamic_stress_drop", stress.max() - stress[orbit.argmax()]),
    ):
        assert extreme == pytest.approx(found[name], abs=2.0 * found[f"{name}_error"]), name
    # the spring has all that the load point moved and the slider did not
    moved = scene.load_velocity * found["time"] - found["slip"]
    assert stress - stress[0] == pytest.approx(scene.stiffness * moved, abs=1e-9 * scene.a)
