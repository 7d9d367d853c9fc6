"""Tests of the motion after a step of load velocity.

The tests cover conserved peaks, error estimates, the effect of inertia, and unbounded slip
rates.
"""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from rsfstudy import Scene
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.responses.step_response import StepResponse
from rsfstudy.status import Status

SLOWNESS = {"law": "slowness", "normal_stress": "constant"}


def response(peaks: int = 3, rtol: float = 1e-7, **fields):
    return StepResponse(peaks=peaks, phases=50)(Scene(**fields), Accuracy(rtol))


def closed_peak(weakening: float, load: float) -> float:
    """Return log10 of the peak slip rate from the conserved quantity.

    For the slowness law at k = k_cr and constant normal stress, H = Omega - ln Omega +
    lambda (w - ln w) is conserved, with Omega = V theta/D_c and w = V_0 theta/D_c. At a
    peak, lambda (w - Omega) = (1 + lambda)(1 - Omega).
    """
    conserved = 1.0 + weakening * (load - math.log(load))

    def excess(log_w: float) -> float:
        omega = 1.0 + weakening * -math.expm1(log_w)
        here = omega - math.log(omega) + weakening * (math.exp(log_w) - log_w)
        return here - conserved

    log_w = brentq(excess, -1e4, -1e-12, xtol=1e-13)
    omega = 1.0 + weakening * -math.expm1(log_w)
    return (math.log(omega * load) - log_w) / math.log(10.0)


@pytest.mark.parametrize(("weakening", "load"), [(1.0, 2.0), (0.5, 20.0), (3.0, 5.0), (1.0, 200.0)])
def test_peaks_of_the_slowness_law_are_those_of_its_conserved_quantity(weakening, load):
    """Peaks agree with the conserved quantity to the requested accuracy.

    The peak after a 200-fold step is 10^87 V_*.
    """
    found = response(b_over_a=1.0 + weakening, load_velocity_ratio=load, **SLOWNESS)
    assert found.status is Status.OK
    np.testing.assert_allclose(
        found.values["peak_log10_slip_rate"], closed_peak(weakening, load), rtol=1e-6
    )
    # Neutral orbits propagate errors from peak to peak, so the tolerance is ten times rtol.
    assert found.values["peak_ratio"] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8])
def test_the_error_estimate_covers_the_error_and_is_smooth(rtol):
    """The error estimate covers the error and varies smoothly.

    The load velocities are successive floats, for which different steps are rejected. The
    estimates differ by less than a factor of ten.
    """
    load, errors = 20.0, []
    for _ in range(8):
        load = math.nextafter(load, math.inf)
        found = response(peaks=2, b_over_a=2.0, load_velocity_ratio=load, rtol=rtol, **SLOWNESS)
        error = abs(found.values["max_log10_slip_rate"] - closed_peak(1.0, load))
        errors.append(found.values["max_log10_slip_rate_error"])
        # The closed form has 13 digits.
        assert error <= errors[-1] + 1e-12
    assert max(errors) < 10.0 * min(errors)


def test_mass_lowers_the_peak_after_a_large_step_and_leaves_small_ones_alone():
    large, small = (
        [
            response(law="slowness", load_velocity_ratio=load, inertia=inertia).values
            for inertia in (False, True)
        ]
        for load in (200.0, 2.0)
    )
    assert large[0]["max_log10_slip_rate"] == pytest.approx(13.34, abs=0.01)
    assert large[1]["max_log10_slip_rate"] == pytest.approx(8.95, abs=0.01)
    assert small[1]["max_log10_slip_rate"] == pytest.approx(
        small[0]["max_log10_slip_rate"], abs=1e-7
    )
