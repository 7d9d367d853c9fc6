"""Tests of stick-slip limit cycles.

The tests compare limit cycles with references in extended precision and with published
numbers, and check the requested accuracy and the balances of an orbit.
"""

import functools
import math
import warnings

import numpy as np
import pytest

import rsfstudy
from rsfstudy import Scene
from rsfstudy.errors import NoResultWarning
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.recording import MOTION_VARIABLE_NAMES
from rsfstudy.status import Status

CASES = [
    {"law": law, "normal_stress": stress}
    for law in ("slip", "slowness")
    for stress in ("constant", "variable")
]
HEADLINES = [output.name for output in LimitCycle().outputs if output.error]


def scene(**fields) -> Scene:
    return Scene(**{"stiffness_ratio": 0.8, "load_velocity_ratio": 2.0, "inertia": True, **fields})


@functools.cache
def measured(of: Scene, rtol: float = 1e-7) -> dict:
    """Return the outputs of a limit cycle, cached for all tests."""
    outcome = LimitCycle()(of, Accuracy(rtol, 3_000_000))
    assert outcome.status is Status.OK, outcome.message
    return dict(outcome.values)


@pytest.mark.parametrize("case", CASES)
def test_default_accuracy_and_work(case):
    """The outputs agree to 1e-6 with a tolerance that is 100 times smaller.

    The differences are within the error estimates.
    """
    found, tight = measured(scene(**case)), measured(scene(**case), 1e-9)
    for name in HEADLINES:
        assert found[name] == pytest.approx(tight[name], rel=1e-6)
        allowed = found[f"{name}_error"] + tight[f"{name}_error"]
        assert abs(found[name] - tight[name]) <= allowed
        assert found[f"{name}_error"] < 1e-5 * abs(found[name])


def test_work_per_cycle():
    """The mean work per cycle is at most 3,000 evaluations.

    The mean is over the cases of the paper, at the default tolerance.
    """
    assert np.mean([measured(scene(**case))["work_per_cycle"] for case in CASES]) <= 3_000


@pytest.mark.parametrize("case", CASES)
def test_balances_of_the_orbit(case):
    """The orbit is closed and consistent with the scalar outputs.

    Slip per cycle is V_0 times the interval, and the stress drops follow from the recorded
    stress.
    """
    found = measured(scene(**case))
    assert found["slip_per_event"] == pytest.approx(2.0 * found["recurrence_interval"], rel=1e-14)
    assert found["time"][-1] == pytest.approx(found["recurrence_interval"], rel=1e-6)
    assert found["slip"][-1] == pytest.approx(found["slip_per_event"], rel=1e-6)
    for name in ("log10_slip_rate", "shear_stress", "normal_stress_ratio", "state_variable"):
        assert found[name][-1] == pytest.approx(found[name][0], abs=1e-5)
    assert (np.diff(found["time"]) >= 0.0).all()
    assert np.ptp(found["shear_stress"]) == pytest.approx(found["static_stress_drop"], rel=1e-3)
    # The dynamic stress drop ends at the peak slip rate, and the orbit has 400 points.
    peak = found["shear_stress"][found["log10_slip_rate"].argmax()]
    dynamic = found["shear_stress"].max() - peak
    assert dynamic == pytest.approx(found["dynamic_stress_drop"], rel=0.1)
    assert dynamic < 0.9 * found["static_stress_drop"]
    assert found["log10_slip_rate"].max() == pytest.approx(found["max_log10_slip_rate"], abs=0.05)
    assert found["log10_slip_rate"].min() == pytest.approx(found["min_log10_slip_rate"], abs=0.3)
    # Both regimes are resolved, because no change of the slip rate exceeds a few per cent of its
    # range.
    assert np.abs(np.diff(found["log10_slip_rate"])).max() < 0.05 * np.ptp(found["log10_slip_rate"])


@pytest.mark.parametrize("case", CASES, ids=str)
def test_an_orbit_of_two_points_is_the_ends_of_any(case):
    """The outputs do not depend on the number of recorded points.

    An orbit of two points is not recorded. Recording limits the steps of the second, ten
    times more accurate run, which provides the orbit and the error estimates.
    """
    ends, orbit = (LimitCycle(phases=n)(scene(**case), Accuracy(1e-5)) for n in (2, 50))
    assert ends.rhs_evaluations < orbit.rhs_evaluations
    for name, values in orbit.values.items():
        if name.endswith("_error"):
            assert 0.5 * values <= ends.values[name] <= 2.0 * values, name
            continue
        same, off = (values[[0, -1]], 1e-6) if name in MOTION_VARIABLE_NAMES else (values, 1e-12)
        assert ends.values[name] == pytest.approx(same, rel=off, abs=off, nan_ok=True), name


@pytest.mark.parametrize(
    ("law", "load", "drop"), [("slip", 120.0, 0.0560), ("slowness", 110.0, 0.1107)]
)
def test_cycles_near_their_onset_are_waited_for(law, load, drop):
    """Cycles near the end of stick-slip at 139.5 V_* are found.

    At phi = 50 and 0.8 k_cr, cycles at slightly lower velocities converge slowly.
    """
    scene = Scene(law=law, phi=50.0, stiffness_ratio=0.8, load_velocity_ratio=load, inertia=True)
    outcome = LimitCycle(phases=2)(scene, Accuracy(1e-6))
    assert outcome.status is Status.OK
    assert outcome.values["static_stress_drop"] == pytest.approx(drop, abs=1e-4)
    beyond = LimitCycle(phases=2)(scene.with_(load_velocity_ratio=145.0), Accuracy(1e-6))
    assert beyond.status is Status.NO_LIMIT_CYCLE


#: Cycles in which slip nearly stops, and their recurrence intervals from an independent code
#: with other unknowns and time as the independent variable, to its accuracy.
NEARLY_STOPPED = [
    (
        {"law": "slip", "a": 0.008794017206350683, "b_over_a": 4.941051988536554,
         "mu_star": 0.6383162760615213, "period": 407.6129114047208,
         "reference_rate": 3.2171954288536213e-10, "phi": 54.42406958714466,
         "alpha": 0.5377004681414724, "stiffness_ratio": 0.3804142175724484,
         "load_velocity_ratio": 86.431987832162},
        0.798761,
    ),
    (
        {"law": "slowness", "a": 0.004822260947305701, "b_over_a": 5.36849678524829,
         "mu_star": 0.6052299536973429, "period": 2.621331736312295,
         "reference_rate": 8.347835049891749e-07, "phi": 38.97235270206339,
         "alpha": 0.44646546358794825, "stiffness_ratio": 0.573530636703891,
         "load_velocity_ratio": 1.2036896528515733},
        49.20716,
    ),
]  # fmt: skip


@pytest.mark.parametrize(("fields", "interval"), NEARLY_STOPPED)
def test_time_goes_on_where_slip_nearly_stops(fields, interval):
    """The interval is accurate at slip rates of 10^-137 and 10^-1745 V_*.

    With negligible slip, the spring recovers the static stress drop at the rate K V_0,
    which is a lower bound of the interval.
    """
    slider = Scene(inertia=True, **fields)
    found = measured(slider)
    assert found["recurrence_interval"] == pytest.approx(interval, rel=1e-6)
    assert found["min_log10_slip_rate"] < -130.0
    reloading = found["static_stress_drop"] / (slider.stiffness * slider.load_velocity)
    assert reloading < interval < 1.1 * reloading


def test_cycles_that_come_closer_slowly_are_leapt_ahead_of():
    """The fixed point is extrapolated from three cycles.

    The derivative of the return map is 0.06, so plain iteration would need six cycles for
    seven digits. The first event is not mistaken for the cycle.
    """
    outcome = measured(scene(law="slowness", normal_stress="constant"))
    assert 5 < outcome["events_until_repeat"] < 9
    assert outcome["recurrence_interval"] == pytest.approx(
        23.93999870907226927, abs=outcome["recurrence_interval_error"]
    )


@pytest.mark.parametrize("rtol", [1e-8, 1e-9])
def test_a_leap_lands_where_time_is_counted_from(rtol):
    """An extrapolation ends on the section that defines the interval.

    At variable normal stress, a straight line between two maxima of spring stress leaves
    this section, which would change the interval by 2.5e-7. The reference is the result of
    60 cycles with rtol = 1e-9 without extrapolation.
    """
    found = measured(scene(law="slowness", stiffness_ratio=0.9, load_velocity_ratio=30.0), rtol)
    assert found["recurrence_interval"] == pytest.approx(0.59456737078, rel=rtol)
    assert found["recurrence_interval_error"] < rtol


@pytest.mark.parametrize(
    ("fields", "known"),
    [
        ({"law": "slowness"}, True),
        ({"law": "composite"}, True),
        ({"law": "slowness", "fluid": "dilatant", "dilatancy": 1e-4}, True),
        ({"law": "cut_off", "cutoff_velocity_ratio": 10.0}, False),
        ({"law": "two_slip_states"}, False),
        ({"law": "two_slip_states", "b1_over_a": 2.0, "b2_over_a": -2.0}, False),
    ],
)
def test_the_healing_exponent_is_that_of_theta_where_there_is_one(fields, known):
    """The healing exponent is defined if the state is b ln(theta/theta_*).

    The exponent is undefined for several states and for a cut-off. With two states, b may
    be 0.
    """
    found = LimitCycle(phases=2)(
        scene(normal_stress="constant", **{"stiffness_ratio": 0.7, **fields}), Accuracy(1e-4)
    )
    assert found.status is Status.OK, found.message
    assert math.isfinite(found.values["healing_exponent"]) is known


@pytest.mark.parametrize(
    ("changes", "mode"),
    [
        # The peaks are 10^4.4 and 10^3.3 V_*, on both sides of a/eta = 10^4.16.
        ({"radiation_damping": 1e-6, "stiffness_ratio": 0.9}, "stick_slip"),
        ({"radiation_damping": 1e-6, "stiffness_ratio": 0.99}, "slow_slip"),
        ({"inertia": True, "stiffness_ratio": 0.9}, "stick_slip"),
        (
            {"radiation_damping": 0.0, "inertia": True, "stiffness_ratio": 1.05},
            "damped_oscillation",
        ),
        # The roots of p^2 + (k - 1) p + k = 0, in units of a, are complex for k below 3 + sqrt 8
        # = 5.83.
        ({"stiffness_ratio": 5.75}, "damped_oscillation"),
        ({"stiffness_ratio": 5.9}, "steady"),
    ],
)
def test_slip_modes(changes, mode):
    scene = Scene(law="slowness", normal_stress="constant", b_over_a=2.0, load_velocity_ratio=2.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NoResultWarning)
        found = rsfstudy.limit_cycle(scene.with_(**changes), rtol=1e-4, engine="compiled").slip_mode
    meanings = found.attrs["flag_meanings"].split()
    assert found.attrs["flag_values"] == [0.0, 1.0, 2.0, 3.0]
    assert meanings[int(found)] == mode


def test_a_slow_peak_is_slow_by_the_norm_where_nothing_radiates():
    """Without radiation damping, the slip mode follows from the norm.

    The norm is V T/(2 pi D_c), so the mode depends on the period of the scene.
    """
    scene = Scene(law="slowness", normal_stress="constant", stiffness_ratio=0.9, inertia=True,
                  load_velocity_ratio=2.0)  # fmt: skip
    cycle = rsfstudy.limit_cycle(scene, rtol=1e-4, engine="compiled")
    fastest = 10.0 ** float(cycle.max_log10_slip_rate)
    for share, mode in ((0.5, 3.0), (2.0, 2.0)):
        norm = share * fastest * scene.inertial_time
        again = rsfstudy.limit_cycle(
            scene.with_(instability_norm=norm), rtol=1e-4, engine="compiled"
        )
        assert float(again.slip_mode) == mode


def test_a_spring_that_is_critical_is_told_from_one_that_takes_its_time():
    """The message distinguishes neutral from slowly growing oscillations.

    Inertia lowers the critical stiffness by a relative 6e-6, which makes the oscillations
    neutral.
    """
    spring = {"stiffness": 0.006, "period": 0.02, "inertia": True}
    kind = {"law": "slowness", "normal_stress": "constant"}
    slow = Scene(**kind, a=0.01, b_over_a=1.6, reference_rate=1.0, **spring)
    outcome = LimitCycle(events=10)(slow, Accuracy(1e-8))
    assert outcome.status is Status.WORK_BUDGET_SPENT
    assert "neither grow nor decay" in outcome.message
    assert outcome.message.endswith("To compute more events, pass --set events=20 (events=)")
    near = LimitCycle(events=10)(slow.with_(stiffness=0.00594), Accuracy(1e-8))
    assert "To compute more events" in near.message
