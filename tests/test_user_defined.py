"""Tests of user-defined reductions, laws and measures.

The examples follow the documentation.
"""

import json
import math
import pickle
from dataclasses import dataclass
from typing import ClassVar

import pytest
import xarray as xr
from study_runs import run, study_of

import rsfstudy
from rsfstudy import Accuracy, Axis, Claim, Figure, Panel, Rig, Scene, Study
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.errors import InvalidValue, NoResultWarning
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.measures import Measure, Outcome
from rsfstudy.motion.integrator import Integrator
from rsfstudy.quantities import Output
from rsfstudy.reductions import LinearFit, ProportionalFit, Reduction
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.slider.laws import Law, LawBase
from rsfstudy.slider.normal_stress import NormalStress
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.slider.parts import collect_parameter_values, number
from rsfstudy.status import Status


# ---- reductions ---------------------------------------------------------------------------------
class Largest(Reduction):
    def __call__(self, dataset):
        return xr.Dataset({self.name: dataset[self.of].max("b_over_a")})


class HalfSlope(LinearFit):
    """User-defined subclass of a built-in reduction with another result."""

    def __call__(self, dataset):
        return 0.5 * super().__call__(dataset)


def reducing(*reductions) -> Study:
    axis = Axis("b_over_a", [2.0, 3.0, 4.0])
    return study_of("reducing", LinearStability(), axis, reductions=list(reductions))


def test_a_reduction_needs_no_more_than_a_call(tmp_path):
    of = "critical_stiffness"
    slope = HalfSlope("slope", of=of, on="b_over_a")
    dataset = run(reducing(Largest("largest", of=of), slope), output=tmp_path)
    assert dataset.largest == dataset.critical_stiffness.max()
    kinds = [one["kind"] for one in declaration_of(dataset)["reductions"]]
    assert kinds == ["Largest", "HalfSlope"]
    with pytest.raises(InvalidValue, match="reduction .Largest. is not part of rsfstudy"):
        _ = rsfstudy.open(tmp_path / "reducing.nc").rsf.study


def declaration_of(dataset: xr.Dataset) -> dict:
    """Return the declaration of a dataset."""
    return json.loads(dataset.attrs["declaration"])


def test_a_reduction_that_returns_no_dataset_is_refused():
    class Array(Reduction):
        def __call__(self, dataset):
            return dataset[self.of].max()

    with pytest.raises(
        InvalidValue, match=r"result of Array must return .*'DataArray'.*self\.results"
    ):
        run(reducing(Array("largest", of="critical_stiffness")))


# ---- keywords -----------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("kind", "wrong", "meant"),
    [
        (ProportionalFit, {"name": "z", "of": "x", "intercep": 1.0}, "intercept"),
        (Largest, {"name": "z", "of": "x", "off": "x"}, "of"),
        (CriticalStep, {"directions": "up"}, "direction"),
        (Axis, {"dimension": "a", "values": [1.0], "unit": {}}, "units"),
        (Study, {"titel": "x"}, "title"),
        (Claim, {"tolerence": 1.0}, "tolerance"),
        (Panel, {"colour": "x"}, None),
        (Figure, {"panel": []}, "panels"),
        (Accuracy, {"rtoll": 1e-3}, "rtol"),
        (Rig, {"normal_stres": "5 MPa"}, "normal_stress"),
    ],
)
def test_an_unknown_keyword_is_reported_with_the_valid_ones(kind, wrong, meant):
    with pytest.raises(
        TypeError, match=rf"{kind.__name__}\(\) has no parameter .* Parameters: \w+"
    ):
        kind(**wrong)
    if meant:
        with pytest.raises(TypeError, match=f"Did you mean '{meant}'"):
            kind(**wrong)


def test_declarations_are_copied_as_before():
    for made in (ProportionalFit("z", of="x"), CriticalStep(), Axis("a", [1.0]), Accuracy()):
        assert pickle.loads(pickle.dumps(made)) == made


def test_a_velocity_step_is_a_step_of_the_load_velocity_ratio():
    assert CriticalStep(of="velocity_step") == CriticalStep(of="load_velocity_ratio")
    with pytest.raises(InvalidValue, match="Choices: load_velocity_ratio, displacement_step"):
        CriticalStep(of="acceleration")


# ---- laws ---------------------------------------------------------------------------------------
def two_parameters(log_slip_rate, state, p):
    """Return the rate of a slip law with two additional parameters.

    The parameter p[LAW + 1] increases the rate, and p[LAW + 2] decreases it.
    """
    return -(state + p[LAW] * log_slip_rate) * p[LAW + 1] / p[LAW + 2]


@dataclass(frozen=True, kw_only=True)
class Declared(Law):
    speed: float = number(1.0, "$s$", "1", "factor of the evolution")
    slowness: float = number(1.0, "$q$", "1", "divisor of the evolution")
    name = "declared"
    evolution = staticmethod(two_parameters)


@dataclass(frozen=True, kw_only=True)
class Overridden(Declared):
    """Law that overrides ``numbers`` and is extended by a further subclass."""

    name = "overridden"

    def parameter_values(self, scene):
        return (scene.a * self.b_over_a, math.log(self.speed), self.slowness**2)


@dataclass(frozen=True, kw_only=True)
class Further(Overridden):
    offset: float = number(0.0, "$o$", "1", "number of a class below")
    missing: float | None = number(None, "$m$", "1", "number that may be missing")
    name = "further"


def test_fields_of_a_law_follow_b_in_the_order_of_their_declaration():
    common = {"a": 0.01, "b_over_a": 2.0, "normal_stress": "constant", "stiffness": 0.01}
    scene = Scene(law=Declared, speed=3.0, slowness=1.5, **common)
    assert scene.parameter_values[LAW:] == pytest.approx((0.02, 3.0, 1.5), rel=1e-15)
    # The evolution is twice as fast as for the slip law, so D_c and k_cr also change by a factor
    # of 2.
    slip = Scene(law="slip", **common)
    assert scene.critical_stiffness == pytest.approx(2.0 * slip.critical_stiffness, rel=1e-5)


def test_numbers_that_a_law_returns_itself_are_not_repeated():
    law = Further(speed=math.e, slowness=3.0, offset=7.0)
    found = collect_parameter_values(law, Scene(a=0.01, stiffness=0.01))
    assert found[:-1] == pytest.approx((0.02, 1.0, 9.0, 7.0))
    assert math.isnan(found[-1])


def test_fields_of_other_parts_are_passed_too():
    @dataclass(frozen=True, kw_only=True)
    class Stress(NormalStress):
        softness: float = number(0.5, "$f$", "1", "softness")
        name = "soft"

    @dataclass(frozen=True, kw_only=True)
    class States(LawBase):
        third: float = number(0.25, "$t$", "1", "third")
        name = "states"

    scene = Scene()
    assert collect_parameter_values(Stress(), scene) == (0.5,)
    # The fields of a law have fixed positions and are not included.
    assert collect_parameter_values(States(), scene) == (0.25,)


# ---- measures that follow a motion --------------------------------------------------------------
@dataclass(frozen=True)
class PeakFriction(Measure):
    """Measure of the maximum of friction, as in the documentation."""

    name: ClassVar[str] = "peak_friction"
    primary_output, typical_rhs_evaluations = "peak_friction", 500
    outputs = (Output("peak_friction", r"$\mu_p$", "1", "largest friction after the step"),)

    def compute(self, scene, integrator):
        motion = rsfstudy.simulate(scene, duration=5.0, integrator=integrator)
        peak = float(motion.friction_coefficient.max())
        return Outcome(Status.OK, {"peak_friction": peak})


STEPPED = Scene(law="slip", normal_stress="constant", stiffness_ratio=3.0)
PEAKS = study_of("peaks", PeakFriction(), Axis("load_velocity_ratio", [1.5, 2.0]), base=STEPPED)


def test_a_motion_within_a_measure_counts_as_work_of_its_cell():
    found = run(PEAKS, rtol=1e-4)
    for cell in range(2):
        alone = rsfstudy.simulate(PEAKS.scene(cell), duration=5.0, rtol=1e-4)
        assert int(found.rhs_evaluations[cell]) == alone.attrs["rhs_evaluations"] > 50
        assert float(found.peak_friction[cell]) == float(alone.friction_coefficient.max())


def test_a_motion_within_a_measure_keeps_to_the_budget_of_its_cell():
    with pytest.warns(rsfstudy.errors.IncompleteWarning, match="work_budget_spent 2"):
        found = run(PEAKS, budget=40)
    assert (found.status == int(Status.WORK_BUDGET_SPENT)).all()
    assert found.peak_friction.isnull().all()


def test_several_motions_of_one_integrator_report_their_own_work():
    integrator = Integrator(Accuracy(1e-3, 100_000))
    scene = STEPPED.with_(load_velocity_ratio=2.0)
    motions = [rsfstudy.simulate(scene, integrator=integrator) for _ in range(2)]
    first, second = (motion.attrs["rhs_evaluations"] for motion in motions)
    assert first == second == integrator.evaluations / 2
    with pytest.raises(
        InvalidValue,
        match="'integrator' must be an Integrator .got Accuracy.*. Pass integrator=integrator",
    ):
        rsfstudy.simulate(scene, integrator=Accuracy())


def test_a_motion_with_radiation_damping_says_what_its_stress_leaves_out():
    damped = rsfstudy.simulate(STEPPED.with_(load_velocity_ratio=2.0, radiation_damping=0.01))
    plain = rsfstudy.simulate(STEPPED.with_(load_velocity_ratio=2.0))
    for name in ("shear_stress", "friction_coefficient"):
        assert "minus the radiation damping stress at V_star" in damped[name].attrs["long_name"]
        assert "damping" not in plain[name].attrs["long_name"]
    # Both stresses are equal in steady sliding at V_*, and differ by eta (V - V_*) otherwise.
    rate = 10.0**damped.log10_slip_rate
    radiated = damped.shear_stress - damped.frictional_stress
    xr.testing.assert_allclose(radiated, 0.01 * (rate - 1.0), atol=1e-9)


# ---- overflows of user-defined laws -------------------------------------------------------------
def power_evolution(log_slip_rate, state, p):
    """Return the evolution of d theta/dt = 1 - (V theta/D_c)^2."""
    exponent = state / p[LAW] + log_slip_rate
    return p[LAW] * (math.exp(-exponent) - math.exp(exponent))


@dataclass(frozen=True, kw_only=True)
class PowerLawEvolution(Law):
    name = "power_evolution"
    evolution = staticmethod(power_evolution)


@pytest.mark.parametrize("engine", ["scipy", "python"])
def test_steppers_reject_trial_steps_in_which_a_law_overflows(engine):
    """The law overflows in a trial step at the beginning of a rupture.

    The recurrence interval is the result of the compiled engine, in which exp(x) can be infinite.
    """
    scene = Scene(law=PowerLawEvolution, normal_stress="constant", b_over_a=1.5,
                  stiffness_ratio=0.05, inertia=True)  # fmt: skip
    motion = rsfstudy.limit_cycle(scene, engine=engine, rtol=1e-3)
    assert float(motion.recurrence_interval) == pytest.approx(680.58956, rel=1e-3)


def steep_evolution(log_slip_rate, state, p):
    """Overflow if the slip rate is far from steady sliding."""
    return -p[LAW] * math.sinh(1e3 * (state / p[LAW] + log_slip_rate)) / 1e3


@dataclass(frozen=True, kw_only=True)
class SteepLaw(Law):
    name = "overflowing"
    evolution = staticmethod(steep_evolution)


@pytest.mark.parametrize("engine", ["scipy", "python", "compiled"])
def test_an_overflow_at_the_start_of_a_step_names_the_law(engine):
    scene = Scene(law=SteepLaw, normal_stress="constant", b_over_a=0.5, stiffness=1.0,
                  load_velocity_ratio=1.0, initial_state=0.02)  # fmt: skip
    outcome = LimitCycle()(scene, Accuracy(engine=engine))
    assert outcome.status is Status.INTEGRATION_FAILED
    assert "the function evolution of the part 'overflowing' overflows" in outcome.message
    assert "log_slip_rate = " in outcome.message
    assert ", state = 0.0" in outcome.message


def test_an_overflow_during_a_motion_names_the_law():
    scene = Scene(law=SteepLaw, normal_stress="constant", b_over_a=1.5, stiffness_ratio=0.3,
                  inertia=True, load_velocity_ratio=10.0)  # fmt: skip
    with pytest.warns(NoResultWarning, match="evolution of the part 'overflowing' overflows"):
        rsfstudy.limit_cycle(scene, engine="python", rtol=1e-4)
