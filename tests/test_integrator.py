"""Tests of the integrator that measures receive.

The motions of a measure are counted together and use the engine and accuracy of the run. Measures
with the former arguments ``accuracy`` and ``meter`` work in the same way.
"""

import warnings
from dataclasses import dataclass
from typing import ClassVar

import pytest
from study_runs import run, study_of

import rsfstudy
from rsfstudy import Accuracy, Axis, Integrator, Scene
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import CriticalStep, Measure, Outcome, Output, Status
from rsfstudy.motion.engines import PYTHON, SCIPY

STEPPED = Scene(normal_stress="constant", stiffness_ratio=3.0, load_velocity_ratio=2.0)
CYCLING = Scene(normal_stress="constant", stiffness_ratio=0.8, radiation_damping=1e-3)
OUTPUTS = (
    Output("number", "", "1", "result of the function"),
    Output("work", "", "1", "number of evaluations that the function reports"),
)


def test_copies_share_the_count_and_the_budget():
    integrator = Integrator(Accuracy(1e-4, budget=10_000, engine=PYTHON))
    copies = integrator.refined(), integrator.with_rtol(1e-6), integrator.tightened_to(1e-9)
    for number, copied in enumerate((integrator, *copies), start=1):
        before = integrator.evaluations
        *_, last = copied.follow(STEPPED, until=2.0)
        assert last.time == 2.0
        assert copied.engine == PYTHON
        assert copied.work_meter is integrator.work_meter, number
        assert copied.evaluations == integrator.evaluations > before
    assert [copied.rtol for copied in copies] == [1e-4, 1e-6, 1e-9]
    assert copies[0].local_tolerance == pytest.approx(0.1 * integrator.local_tolerance)
    assert sum(integrator.work_meter.evaluations_by_regime.values()) == integrator.evaluations
    assert not integrator.is_budget_exceeded


def test_a_tolerance_within_the_limit_is_kept():
    integrator = Integrator(Accuracy(1e-6))
    assert integrator.tightened_to(1e-5) is integrator.loosened_to(1e-7) is integrator
    assert integrator.tightened_to(1e-8).rtol == 1e-8
    assert integrator.loosened_to(1e-3).rtol == 1e-3
    assert integrator.result_tolerance(10.0) == pytest.approx(1e-5)


FUNCTIONS = {
    "simulate": lambda scene, **how: rsfstudy.simulate(scene, duration=3.0, **how),
    "critical_step": lambda scene, **how: rsfstudy.critical_step(scene, "displacement_step", **how),
    "limit_cycle": lambda _scene, **how: rsfstudy.limit_cycle(CYCLING, **how),
}
RESULT_OF = {
    "simulate": lambda found: float(found.friction_coefficient[-1]),
    "critical_step": lambda found: found.critical_displacement.item(),
    "limit_cycle": lambda found: found.recurrence_interval.item(),
}


def work_of(found) -> int:
    """Return the number of evaluations that a dataset reports."""
    return int(found.attrs.get("rhs_evaluations", found.get("rhs_evaluations")))


@dataclass(frozen=True)
class Twice(Measure):
    """Measure that calls a public function twice with its integrator."""

    function: str = "simulate"
    name: ClassVar[str] = "twice"
    primary_output, typical_rhs_evaluations, outputs = "number", 1_000, OUTPUTS

    def compute(self, scene, integrator):
        for _ in range(2):
            found = FUNCTIONS[self.function](scene, integrator=integrator)
        values = {"number": RESULT_OF[self.function](found), "work": float(work_of(found))}
        assert found.attrs["engine"] == integrator.engine
        assert found.attrs["rtol"] == integrator.rtol
        return Outcome(Status.OK, values)


@pytest.mark.parametrize("engine", [SCIPY, PYTHON])
@pytest.mark.parametrize("function", FUNCTIONS)
def test_functions_use_and_count_for_the_integrator_of_a_measure(function, engine):
    alone = FUNCTIONS[function](STEPPED, rtol=1e-4, engine=engine)
    outcome = Twice(function)(STEPPED, Accuracy(1e-4, engine=engine))
    assert outcome.values["number"] == RESULT_OF[function](alone)
    assert outcome.values["work"] == work_of(alone) > 50
    assert outcome.rhs_evaluations == 2 * work_of(alone)


def test_the_work_of_a_function_counts_for_its_cell():
    axes = Axis("stiffness_ratio", [2.0, 3.0])
    found = run(study_of("twice", Twice("critical_step"), axes, base=STEPPED), rtol=1e-4)
    assert (found.rhs_evaluations == 2 * found.work).all()


def test_a_nested_function_does_not_warn():
    """The status of the dataset reports that there is no limit cycle."""
    integrator = Integrator(Accuracy(1e-4))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = rsfstudy.limit_cycle(STEPPED, integrator=integrator)
    assert found.attrs["status"] == "no_limit_cycle"
    assert integrator.evaluations == work_of(found) > 0


# ---- the former arguments -----------------------------------------------------------------------


def define_former_measures() -> tuple[type[Measure], type[Measure]]:
    """Define a measure with the former arguments, and a former subclass of a built-in measure."""

    @dataclass(frozen=True)
    class Former(Measure):
        name: ClassVar[str] = "former"
        primary_output, typical_rhs_evaluations, outputs = "number", 1_000, OUTPUTS

        def compute(self, scene, accuracy, meter):
            step = CriticalStep(of="displacement_step").run_nested(scene, accuracy, meter)
            motion = rsfstudy.simulate(
                scene, duration=3.0, accuracy=accuracy.refined(), meter=meter
            )
            values = {"number": float(motion.friction_coefficient[-1]), "work": meter.evaluations}
            return Outcome(step.status, values)

    class Doubled(CriticalStep):
        def compute(self, scene, accuracy, meter):
            outcome = super().compute(scene, accuracy, meter)
            name = self.primary_output
            return Outcome(outcome.status, {name: 2.0 * outcome.values[name], f"{name}_error": 0.0})

    return Former, Doubled


def test_measures_with_the_former_arguments_work():
    with pytest.warns(DeprecationWarning, match="compute takes scene, accuracy and meter") as told:
        former, doubled = define_former_measures()
    assert len(told) == 2
    assert {warning.filename for warning in told} == {__file__}
    assert "compute(self, scene, integrator)" in str(told[0].message)
    accuracy, wanted = Accuracy(1e-4, engine=PYTHON), CriticalStep(of="displacement_step")
    with pytest.warns(DeprecationWarning, match="Pass integrator=integrator"):
        outcome = former()(STEPPED, accuracy)
    step = wanted(STEPPED, accuracy)
    integrator = Integrator(accuracy.refined())
    motion = rsfstudy.simulate(STEPPED, duration=3.0, integrator=integrator)
    assert outcome.values["number"] == float(motion.friction_coefficient[-1])
    assert outcome.rhs_evaluations == step.rhs_evaluations + integrator.evaluations
    assert outcome.values["work"] == outcome.rhs_evaluations
    with pytest.warns(DeprecationWarning, match="Pass integrator=integrator") as told:
        twice = doubled(of="displacement_step")(STEPPED, accuracy)
    assert {warning.filename for warning in told} == {__file__}
    name = wanted.primary_output
    assert twice.values[name] == 2.0 * step.values[name]
    assert twice.rhs_evaluations == step.rhs_evaluations


@pytest.mark.parametrize("missing", ["accuracy", "meter"])
def test_both_former_arguments_are_necessary(missing):
    integrator = Integrator(Accuracy(1e-3))
    given = {"accuracy": integrator.accuracy, "meter": integrator.work_meter}
    del given[missing]
    with pytest.raises(InvalidValue, match="must be an Accuracy and a WorkMeter.*integrator="):
        rsfstudy.simulate(STEPPED, **given)
    with pytest.raises(InvalidValue, match="must be an Accuracy and a WorkMeter.*integrator="):
        CriticalStep().run_nested(STEPPED, **given)
