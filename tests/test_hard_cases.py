"""Tests of hard cases.

The tests cover random scenes, hundreds of cycles, and rest over a million characteristic
slip times. A wrong result must not have the status OK.
"""

import math
import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rsfstudy.named_studies.hard_cases import HardCase
from study_runs import named_results

import rsfstudy
from rsfstudy import Scene
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.limit_cycles.stick_slip_cycles import iterate_stick_slip_cycles
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED
from rsfstudy.motion.integrator import Integrator
from rsfstudy.responses.rigid_response import RigidResponse
from rsfstudy.responses.step_response import StepResponse
from rsfstudy.status import Status
from rsfstudy.study import study_loader

STUDY = study_loader.load_study("hard_cases")
PROBLEMS = dict(zip(STUDY.axes[0].labels, STUDY.measure.problems, strict=True))


def outcome(label: str, **changes):
    problem = replace(PROBLEMS[label], **changes)
    return HardCase(problems=(problem,))(problem.scene, Accuracy())


def test_a_wrong_number_is_unverified():
    right = PROBLEMS["alpha = 0"].answer
    assert outcome("alpha = 0").status is Status.OK
    wrong = outcome("alpha = 0", answer=right * (1.0 + 1e-6))
    assert wrong.status is Status.UNVERIFIED
    assert "exceeds its estimate" in wrong.message


def test_a_wrong_status_is_unverified():
    wrong = outcome("a slider that locks", status=Status.NO_LIMIT_CYCLE)
    assert wrong.status is Status.UNVERIFIED
    assert "status locked instead of no_limit_cycle" in wrong.message


#: Cases that need more than five times the usual work, with the reasons.
DEAR = {
    "200-fold step, peak at 10^87 V_*": "two loops from 10^-85 to 10^87 V_*",
    "tiny step, k = (1 -0.001) k_cr": "a growth of 1e-3 an orbit, followed up to the norm",
    "critical step, k = (1 -1e-08) k_cr": "a growth that no motion can show is sought by motions",
    "phi = atan(mu_*) + 0.01": "k_cr falls so steeply that only motions tell the boundary",
    "lambda = 0.01": "orbits a hundred times as long, followed on either side of the boundary",
    "norm beyond the inertial peak": "ruptures up to the largest step, none of which is enough",
}


def test_work_stays_bounded(tmp_path_factory):
    """Only listed cases exceed 20,000 evaluations.

    Critical steps usually need 4,000 evaluations, and limit cycles 3,000 evaluations.
    """
    cells, _path = named_results("hard_cases", tmp_path_factory)
    assert set(cells.hard_case.values) == set(PROBLEMS)
    assert set(cells.hard_case.values[cells.rhs_evaluations > 20_000]) <= set(DEAR)


def test_two_hundred_cycles_do_not_drift():
    scene = Scene(
        normal_stress="constant", stiffness_ratio=0.8, load_velocity_ratio=2.0, inertia=True
    )
    intervals = []
    accuracy = Accuracy(1e-5, budget=10**7, engine=COMPILED)
    for cycle in iterate_stick_slip_cycles(scene, Integrator(accuracy), None):
        intervals.append(cycle.recurrence_interval)
        if len(intervals) == 203:
            break
    settled = np.array(intervals[3:])
    # The intervals differ by rounding errors of the steps, which differ in each cycle.
    assert np.ptp(settled) < 1e-5 * settled.mean()
    # Over a thousand cycles, the drift would be a tenth of the tolerance.
    drift = np.polyfit(np.arange(len(settled)), settled, 1)[0]
    assert abs(drift) * 1000 < 1e-6 * settled.mean()


@pytest.mark.parametrize(("law", "slope"), [("slowness", -2.0), ("slip", 0.0)])
def test_a_million_slip_times_at_rest(law, slope):
    """The slip rate of a held slider follows the closed form.

    The load point is held after a step back by 20 D_c. For the slowness law, theta = t, and
    V decreases as t**(-b/a). For the slip law, the state and V stay constant without slip.
    """
    rest = rsfstudy.simulate(
        Scene(law=law, normal_stress="constant", displacement_step=-20.0), duration=1e6
    )
    assert rest.attrs["status"] == "ok"
    assert np.isfinite(rest.log10_slip_rate).all()
    assert float(rest.time[-1]) == pytest.approx(1e6, rel=1e-9)
    later = np.log10(rest.time.values[1:]), rest.log10_slip_rate.values[1:]
    rates = np.interp([4.0, 5.0], *later)
    assert rates[1] - rates[0] == pytest.approx(slope, abs=5e-3)


SCENES = {
    "law": st.sampled_from(["slip", "slowness"]),
    "a": st.floats(1e-4, 0.1),
    "b_over_a": st.floats(1.05, 20.0),
    "stiffness_ratio": st.floats(0.2, 5.0),
    "load": st.floats(-5.0, 3.0),
    "effects": st.one_of(
        st.just({"normal_stress": "constant"}),
        st.fixed_dictionaries({"alpha": st.floats(0.0, 1.0), "phi": st.floats(38.0, 89.0)}),
    ),
    "dynamics": st.sampled_from([{}, {"inertia": True}, {"radiation_damping": 1e-8}]),
    "log_period": st.floats(-6.0, 4.0),
}


@settings(max_examples=20, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(
    **SCENES,
    measure=st.sampled_from(
        [CriticalStep(), RigidResponse(), StepResponse(peaks=2, phases=5), LimitCycle(phases=5)]
    ),
)
def test_any_scene_ends_in_numbers_or_in_a_name(
    law, a, b_over_a, stiffness_ratio, load, effects, dynamics, log_period, measure
):
    """A random scene has a finite result, or a status with a message.

    There are no warnings, exceptions or hangs.
    """
    scene = Scene(
        law=law,
        a=a,
        b_over_a=b_over_a,
        stiffness_ratio=stiffness_ratio,
        load_velocity_ratio=10.0**load,
        period=10.0**log_period,
        **effects,
        **dynamics,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = measure(scene, Accuracy(1e-5, budget=30_000))
    assert found.rhs_evaluations <= 30_001
    if found.status is Status.OK:
        for name in (measure.primary_output, f"{measure.primary_output}_error"):
            assert math.isfinite(found.values[name]), name
    else:
        assert found.message
