"""Oscillating normal stress: exact for ever, no part of steady sliding, and what it makes of spring
stress by linear theory.
"""

import math

import numpy as np
import pytest

from rsfstudy import Scene, simulate
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.course import follow
from rsfstudy.motion.engines import COMPILED
from rsfstudy.motion.events import Kind, settling
from rsfstudy.motion.meter import Meter

CASES = {
    "imposed": {"normal_stress": "imposed", "alpha": 0.3},
    "inclined": {"normal_stress": "variable", "alpha": 0.3, "phi": 60.0},
}
#: Each dynamics with one of them: that those are bound alike is for other tests.
SLIDERS = {
    "imposed": {"law": "slowness", **CASES["imposed"]},
    "inclined, waves": {"law": "slowness", **CASES["inclined"], "radiation_damping": 1e-3},
    "imposed, mass": {"law": "slowness", **CASES["imposed"], "inertia": True},
}
#: An oscillation, on a slider that it does not make stick and slip.
OSCILLATES = {"oscillation_amplitude": 0.02, "oscillation_period": 8.0, "stiffness_ratio": 2.0}


@pytest.mark.parametrize("rtol", [1e-3, 1e-7])
def test_the_amplitude_does_not_drift(rtol):
    """After 300 periods it is off by less than the accuracy, and no more than after 30."""
    scene, off = Scene(**SLIDERS["imposed"], **OSCILLATES), []
    for periods in (30, 300):
        meter = Meter(10**6, engine=COMPILED)
        accuracy = Accuracy(rtol, 10**6, engine=COMPILED)
        *_earlier, end = follow(scene, accuracy, meter, until=8.0 * periods)
        _psi, ahead, relief = end.point.psis
        off.append(abs(math.hypot(ahead, relief) / 0.02 - 1.0))
        # the clock itself drifts by the accuracy in each period at most
        assert abs(relief / 0.02) < 2.0 * math.pi * periods * rtol
    assert max(off) < 0.5 * rtol
    assert off[1] < 3.0 * off[0] + 1e-12


@pytest.mark.parametrize("slider", SLIDERS)
def test_it_never_settles(slider):
    scene, watches = Scene(**SLIDERS[slider], **OSCILLATES), [settling(0.9, ends=True)]
    accuracy, meter = Accuracy(1e-6, engine=COMPILED), Meter(10**5, engine=COMPILED)
    *_earlier, end = follow(scene, accuracy, meter, watches, until=40.0)
    assert (end.kind, end.time) == (Kind.END, 40.0)


def test_faster_than_free_oscillation_with_mass():
    fast = {"oscillation_amplitude": 0.1, "oscillation_period": 5e-8, "inertia": True}
    motion = simulate(Scene(**CASES["imposed"], **fast), duration=2e-7)
    assert motion.attrs["status"] == "ok"
    expected = 1.0 + 0.1 * np.sin(2.0 * np.pi * motion.time / 5e-8)
    assert np.allclose(motion.normal_stress_ratio, expected, rtol=0.0, atol=1e-7)
