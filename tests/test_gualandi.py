"""Tests of compaction with the deterministic model of Gualandi et al. (2023).

The reference is an integration of the equations of the paper in the variables of the paper.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from rsfstudy.named_studies._gualandi import (
    NORMAL_STRESSES,
    build_gualandi_rig,
    build_gualandi_scene,
)
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import rsfstudy
from rsfstudy.errors import RsfStudyWarning
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED, SCIPY
from rsfstudy.motion.integration_events import EventKind, maximum
from rsfstudy.motion.integrator import Integrator

#: Parameters in SI units: atmospheric pressure, slip distance, velocity, direct effect, friction.
P_0, L_1, V_0, A, MU = 101325.0, 3e-6, 1e-5, 0.01, 0.64
#: Unit of time in s.
TIME = L_1 / V_0
LAMBDA = A / MU


def published_rates(_time, unknowns, sigma):
    """Return the rates of x, y, z and u, with the parameters of the paper.

    ``sigma`` is the applied normal stress in Pa.
    """
    x, y, z, u = unknowns
    kappa, nu = 14.8e9 * L_1 / (A * sigma), 10.0 * math.sqrt(31e9 * 2650.0) * V_0 / (A * sigma)
    beta_2 = 1.7e-5 / (LAMBDA * 0.075 * 1.01e-9 * sigma)
    v, effective = math.exp(x), 1.0 + LAMBDA * u
    dz = -0.1 * v * (z + beta_2 * x)
    du = -0.1 * TIME * (P_0 / (LAMBDA * sigma) + u) + dz
    loading = kappa * (1.0 - v)
    # The friction law is sigma (1 + lambda u)(mu_0 + a x + Theta) = mu_0 sigma + a sigma y.
    theta = (y - u) / effective - x
    evolution = -v * (1.2 * x + theta)
    friction = (1.0 + LAMBDA * y) / effective
    dx = (loading - du * friction - effective * evolution) / (effective + nu * v)
    return dx, loading - nu * v * dx, dz, du


def integrate_published_rates(normal_stress: float, times: np.ndarray):
    """Integrate the equations of the paper from the initial point of the scene.

    Peaks of slip rate are the events of the result.
    """
    sigma, scene = 1e6 * normal_stress, build_gualandi_scene(normal_stress)
    sigma_star = sigma - P_0
    x = brentq(lambda x: 1e-3 - A * x - scene.radiation_damping * math.expm1(x), -1.0, 1.0)
    y = (sigma_star * (MU + A * x) - MU * sigma) / (A * sigma)
    start = x, y, 0.0, -P_0 / (LAMBDA * sigma)

    def peak(time, unknowns, sigma):
        return published_rates(time, unknowns, sigma)[0]

    peak.direction = -1.0
    return solve_ivp(published_rates, (0.0, times[-1]), start, "DOP853", t_eval=times,
                     args=(sigma,), events=peak, rtol=1e-11, atol=1e-13)  # fmt: skip


def published_motion(normal_stress: float, times: np.ndarray) -> dict[str, np.ndarray]:
    """Return the motion of the paper in the variables of the package."""
    sigma, scene = 1e6 * normal_stress, build_gualandi_scene(normal_stress)
    sigma_star = sigma - P_0
    x, y, z, u = integrate_published_rates(normal_stress, times).y
    return {
        "log10_slip_rate": x / math.log(10.0),
        "porosity": LAMBDA * sigma / sigma_star * z,
        "pore_pressure": -(LAMBDA * sigma * u + P_0) / sigma_star,
        # The stress y of the paper is frictional, and the spring also balances radiated stress.
        "shear_stress": (MU + A * y) * sigma / sigma_star + scene.radiation_damping * np.expm1(x),
    }


def test_the_scene_has_the_parameters_of_the_paper():
    """The fields equal conversions by hand, at 20.101325 MPa, where sigma_* is 20 MPa."""
    scene = build_gualandi_scene(20.101325)
    assert scene.b == pytest.approx(0.012)
    assert scene.stiffness == pytest.approx(14.8e9 * 3e-6 / 20e6, rel=1e-12)
    assert scene.drainage == pytest.approx(0.03, rel=1e-12)
    assert scene.porosity_length == pytest.approx(10.0, rel=1e-12)
    assert scene.dilatancy == pytest.approx(-1.7e-5 / (7.575e-11 * 20e6), rel=1e-12)
    # The impedance of quartz is 9.06e6 Pa s/m, of which a half is radiated.
    assert scene.radiation_damping == pytest.approx(20.0 * 4.532e6 * 1e-5 / 20e6, rel=1e-4)
    assert build_gualandi_rig(20.101325).dimensionless("0.3 s") == pytest.approx(1.0)
    assert len(NORMAL_STRESSES) == 12


@pytest.mark.parametrize("engine", [SCIPY, COMPILED])
@pytest.mark.parametrize("normal_stress", [15.001, 20.002])
def test_the_motion_is_that_of_the_published_equations(normal_stress, engine):
    """Several events agree with the equations of the paper.

    Integration errors of phase accumulate from event to event.
    """
    times = np.linspace(0.0, 120.0, 241)
    motion = rsfstudy.simulate(
        build_gualandi_scene(normal_stress), times=times, engine=engine, rtol=1e-9
    )
    for name, expected in published_motion(normal_stress, times).items():
        # Log slip rates are of order 1, and stresses are of order a.
        scale = 1.0 if name == "log10_slip_rate" else A
        np.testing.assert_allclose(motion[name], expected, rtol=0, atol=1e-7 * scale, err_msg=name)
    assert float(motion.log10_slip_rate.max()) > 0.8
    assert float(motion.pore_pressure.max()) > 0.005


def recurrence_intervals(
    normal_stress: float, begin: float, end: float, quantity: str = "log_slip_rate"
) -> np.ndarray:
    """Return the intervals between maxima of a quantity in L_1/V_0."""
    scene, integrator = (
        build_gualandi_scene(normal_stress),
        Integrator(Accuracy(1e-8, 10**7, engine=COMPILED)),
    )
    events = integrator.follow(scene, [maximum(quantity)], with_time=True, until=end)
    times = np.array([event.time for event in events if event.kind is EventKind.MAXIMUM])
    return np.diff(times[times > begin])


def coefficient_of_variation(intervals: np.ndarray) -> float:
    """Return the coefficient of variation in per cent."""
    return 100.0 * float(intervals.std() / intervals.mean())


@pytest.mark.parametrize("normal_stress", [15.001, 24.976])
def test_all_intervals_are_equal_and_belong_to_the_limit_cycle(normal_stress):
    """The limit cycle, found by a Newton iteration, has the interval of a long motion."""
    intervals = recurrence_intervals(normal_stress, 1000.0, 1600.0)
    cycle = rsfstudy.limit_cycle(build_gualandi_scene(normal_stress), engine=COMPILED, rtol=1e-8)
    assert cycle.attrs["status"] == "ok"
    found = float(cycle.recurrence_interval)
    np.testing.assert_allclose(intervals, found, rtol=1e-7)


@pytest.mark.parametrize(("normal_stress", "variation"), [(17.003, 10.187), (20.002, 20.301)])
def test_two_intervals_alternate(normal_stress, variation):
    """The cycle has two events, with the intervals of the equations of the paper.

    The coefficient of variation is the difference of the two intervals divided by their sum.
    Gualandi et al. (2023) show about 10.5 % and 21.2 % for their deterministic model.
    """
    intervals = recurrence_intervals(normal_stress, 1000.0, 1600.0)
    np.testing.assert_allclose(intervals[2:], intervals[:-2], rtol=1e-6)
    one, other = intervals[:2].tolist()
    assert coefficient_of_variation(intervals[:24]) == pytest.approx(variation, abs=2e-3)
    assert 100.0 * abs(one - other) / (one + other) == pytest.approx(variation, abs=2e-3)
    # The reference approaches the same cycle within 800 units of time to 1e-6.
    (peaks,) = integrate_published_rates(normal_stress, np.array([0.0, 800.0])).t_events
    np.testing.assert_allclose(sorted(np.diff(peaks)[-2:]), sorted((one, other)), rtol=1e-6)
    with pytest.warns(RsfStudyWarning, match="repeats itself after 2 events"):
        cycle = rsfstudy.limit_cycle(build_gualandi_scene(normal_stress), engine=COMPILED)
    assert cycle.attrs["status"] == "ok"
    # The measure reports the interval between maxima of spring stress before the larger event.
    between = recurrence_intervals(normal_stress, 1000.0, 1200.0, "spring_stress")
    assert float(cycle.recurrence_interval) == pytest.approx(between.max(), rel=1e-4)
