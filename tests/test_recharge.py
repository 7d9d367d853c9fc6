"""Tests of a dilatant fault with imposed external pore pressure.

Fluid flows in or out by dP/dt = c* (R - P) - (dphi/dt)/beta. The references are closed
forms, an independent integration and limits.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rsfstudy import Scene, history, simulate
from rsfstudy.errors import InvalidValue
from rsfstudy.motion.engines import COMPILED, ENGINE_NAMES

#: A pressure ramp up, a constant pressure, and a ramp down to a negative value.
TIME, PRESSURE = np.array([0.0, 4.0, 7.0, 12.0]), np.array([0.0, 0.2, 0.2, -0.1])
AT = np.linspace(0.5, 20.0, 40)
INJECTED = history({"time": TIME, "pore_pressure": PRESSURE})
FAULT = {"law": "slowness", "normal_stress": "imposed", "alpha": 0.2, "stiffness_ratio": 3.0}
DILATANT = {"fluid": "dilatant", "drainage": 0.5}


def at_times(engine=COMPILED, **fields):
    return simulate(Scene(**FAULT, **fields), times=AT, rtol=1e-9, engine=engine)


@pytest.mark.parametrize("engine", ENGINE_NAMES)
def test_pressure_diffuses_into_the_fault(engine):
    """Without dilatancy, the pressure has a closed form.

    The pressure is an exponential mean of the external pressure, computed for each ramp.
    """
    motion = at_times(engine, loading=INJECTED, **DILATANT, dilatancy=0.0)

    def mean(time, begin, slope):
        passed = np.maximum(time - begin, 0.0)
        return slope * (passed - (1.0 - np.exp(-0.5 * passed)) / 0.5)

    slopes = np.append(np.diff(PRESSURE) / np.diff(TIME), 0.0)
    changes = np.diff(slopes, prepend=0.0)
    expected = sum(mean(AT, begin, change) for begin, change in zip(TIME, changes, strict=True))
    assert np.allclose(motion.pore_pressure, expected, rtol=0.0, atol=1e-8)
    assert np.allclose(motion.normal_stress_ratio, 1.0 - expected, rtol=0.0, atol=1e-8)
    around = np.interp(AT, TIME, PRESSURE)  # A rig measures the external pressure.
    read = motion.shear_stress.values / (1.0 - around)
    assert np.allclose(motion.friction_coefficient, read, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("engine", ENGINE_NAMES)
def test_all_of_it_by_other_equations(engine):
    """Stress and pressure agree with an independent integration in time.

    The reference uses the slowness law without inertia.
    """
    scene = Scene(**FAULT, loading=INJECTED, **DILATANT, dilatancy=0.02)
    motion = at_times(engine, loading=INJECTED, **DILATANT, dilatancy=0.02)
    a, b, mu, alpha, stiffness = scene.a, scene.b, scene.mu_star, scene.alpha, scene.stiffness

    def rate(t, y):
        f, theta, porosity, pressure = y
        around = np.interp(t, TIME, PRESSURE)
        s = 1.0 - pressure
        x = ((mu + f) / s - mu - theta + alpha * np.log(s)) / a
        v = np.exp(x)
        opening = v * (0.02 * x - porosity)
        evolving = b * (np.exp(-(theta - alpha * np.log(s)) / b) - v)
        return stiffness * (1.0 - v), evolving, opening, 0.5 * (around - pressure) - opening

    y, springs, pressures = np.zeros(4), [], []
    for begin, end in zip(TIME, [*TIME[1:], AT[-1]], strict=True):
        now = AT[(begin < AT) & (end >= AT)]
        at = np.unique([*now, end])
        run = solve_ivp(rate, (begin, end), y, "DOP853", at, rtol=1e-11, atol=1e-13)
        y = run.y[:, -1]
        springs += run.y[0, : len(now)].tolist()
        pressures += run.y[3, : len(now)].tolist()
    assert np.allclose(motion.shear_stress - mu, springs, rtol=0.0, atol=1e-8)
    assert np.allclose(motion.pore_pressure, pressures, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize(
    ("law", "dynamics"),
    [("slip", {"inertia": True}), ("two_slowness_states", {"radiation_damping": 1e-3})],
)
def test_fast_drainage_is_the_drained_fault(law, dynamics):
    """With fast drainage, the motion approaches the drained motion.

    The pressure lags by 1/c*, and the shear stress differs by mu_* times the pressure rate
    times this lag.
    """
    of_law = {"b1_over_a": 1.5} if law.startswith("two") else {}
    fields = {**dynamics, **of_law, "law": law, "loading": INJECTED}
    scenes = (
        Scene(**FAULT | fields),
        Scene(**FAULT | fields, fluid="dilatant", dilatancy=1e-4, drainage=1e3),
    )
    drained, fast = (simulate(s, times=AT, rtol=1e-8, engine=COMPILED) for s in scenes)
    swing = float(np.ptp(drained.shear_stress.values))
    assert abs(fast.shear_stress - drained.shear_stress).max() < 5e-3 * swing
    assert abs(fast.pore_pressure - np.interp(AT, TIME, PRESSURE)).max() < 1e-3


def test_dilatancy_of_a_still_record_is_that_without_one():
    """A record with constant pressure does not change the motion."""
    still = history({"time": [0.0, 10.0], "pore_pressure": [0.0, 0.0], "velocity": [2.0, 2.0]})
    fields = {**DILATANT, "dilatancy": 0.02}
    with_one = at_times(loading=still, **fields)
    without = at_times(load_velocity_ratio=2.0, **fields)
    for name in ("shear_stress", "pore_pressure", "porosity"):
        assert np.allclose(with_one[name], without[name], rtol=0.0, atol=1e-8)


def test_a_step_of_pressure_around_the_fault_is_none_within_it():
    """A step of external pressure drains into the fault gradually."""
    begun = history({"time": [0.0, 1.0], "pore_pressure": [0.1, 0.1]})
    motion = at_times(loading=begun, **DILATANT, dilatancy=0.0)
    expected = 0.1 * (1.0 - np.exp(-0.5 * AT))
    assert np.allclose(motion.pore_pressure, expected, rtol=0.0, atol=1e-8)


def test_normal_stress_beside_a_fluid_is_refused():
    """A record of normal stress is rejected for a dilatant fault.

    A change of normal stress is not a pressure that drains.
    """
    for columns in ({}, {"pore_pressure": [0.0, 0.1]}):
        record = history({"time": [0.0, 1.0], "normal_stress": [1.0, 1.1], **columns})
        with pytest.raises(InvalidValue, match="cannot be combined with fluid='dilatant'"):
            Scene(**FAULT, **DILATANT, loading=record)
