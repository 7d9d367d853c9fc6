"""Tests of steps and holds without a measurable response."""

import importlib
import math
import pkgutil
from typing import Any

import numpy as np
import pytest
from rsfstudy.named_studies._normal_stress_response import NormalStressResponse

from rsfstudy import Scene, measures, named_studies, vocabulary
from rsfstudy.fitting.fit_measure import Fit
from rsfstudy.fitting.record import Record
from rsfstudy.measure_base.elasticities import Elasticities
from rsfstudy.measures import Measure, Outcome
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED
from rsfstudy.quantities import Quantity
from rsfstudy.responses.healing import Healing
from rsfstudy.responses.velocity_step import VelocityStep
from rsfstudy.status import Status


@pytest.mark.parametrize("digits", range(2, 8))
@pytest.mark.parametrize(
    ("fields", "relaxation"),
    [
        (
            {
                "law": "cut_off", "cutoff_velocity_ratio": 17122.0, "a": 0.0048,
                "b_over_a": 3.56674, "mu_star": 0.71079, "stiffness_ratio": 4.72567,
                "hold_time": 1.87307, "load_velocity_ratio": 0.12839,
            },
            -0.0091962403,
        ),
    ],
)  # fmt: skip
def test_a_peak_stands_above_what_follows_by_more_than_its_error(fields, relaxation, digits):
    """A peak within the error estimate is not reported.

    Friction approaches steady sliding from below, and has a maximum only within the
    tolerance.
    """
    scene = Scene(normal_stress="constant", **fields)
    outcome = Healing(phases=2)(scene, Accuracy(10.0**-digits, engine=COMPILED))
    assert (outcome.status, outcome.message[:20]) == (
        Status.NOT_APPLICABLE,
        "friction has no peak",
    )
    assert outcome.values["relaxation"] == pytest.approx(relaxation, rel=10.0**-digits)


def drawn(number: int) -> Scene:
    """Return a random scene with a velocity step.

    In some scenes, a state strengthens friction.
    """
    draw = np.random.default_rng([4, number])
    several = {
        "law": "two_slowness_states",
        "b1_over_a": 1.0 + draw.uniform(0.1, 1.0),
        "b2_over_a": draw.uniform(-1.0, 0.0),
        "length_ratio": 10.0 ** draw.uniform(-1.0, 1.0),
    }
    b_over_a = 1.0 + 10.0 ** draw.uniform(-1.0, 0.5)
    cut_off = {"law": "cut_off", "cutoff_velocity_ratio": 10.0 ** draw.uniform(-3.0, 2.0)}
    return Scene(
        normal_stress="constant",
        a=0.01,
        stiffness=10.0 ** draw.uniform(-2.0, -0.5),
        load_velocity_ratio=10.0 ** draw.uniform(-1.5, 1.5),
        **([several, {"law": "slip", "b_over_a": b_over_a}, {**cut_off, "b_over_a": b_over_a}])[
            number % 3
        ],
    )


def test_no_number_of_a_step_that_is_ok_is_missing():
    """All outputs of a measure with the status OK are finite.

    Friction may have no extremum (above the cut-off), may evolve in the direction of the
    direct effect (a strengthening state), or may cross the level twice in one integration
    step (at loose tolerances). The random scenes include all cases.
    """
    ended = []
    for number in range(90):
        for rtol in (1e-2, 1e-4):
            scene = drawn(number)
            outcome = VelocityStep(phases=2)(scene, Accuracy(rtol, engine=COMPILED))
            ended.append(outcome.status)
            found = {n: v for n, v in outcome.values.items() if n != "closed_form_departure"}
            if outcome.status is Status.OK:
                assert np.isfinite(np.concatenate([np.ravel(v) for v in found.values()])).all()
    assert set(ended) >= {Status.OK, Status.NOT_APPLICABLE}


NOTHING = Record({name: np.arange(3.0) for name in ("time", "displacement", "friction")})
#: Arguments that measures require.
ASKED: dict[type, list[Any]] = {Fit: [(NOTHING,)], Elasticities: [VelocityStep()]}
#: Parameters of fits that have the same names as fields of scenes and rigs, and an output whose
#: description depends on the measure.
SHARED = {"a", "critical_stiffness", "mu_star", "slip_distance"}


def every_measure() -> list[Measure]:
    """Return all measures of rsfstudy with default fields."""
    for name in measures.__all__:
        getattr(measures, name)  # The access loads the module of the measure.
    for module in pkgutil.iter_modules(named_studies.__path__):
        importlib.import_module(f"{named_studies.__name__}.{module.name}")

    def below(kind: type) -> list[type]:
        return [kind, *(one for derived in kind.__subclasses__() for one in below(derived))]

    ours = (kind for kind in below(Measure) if kind.__module__.startswith("rsfstudy."))
    named = [kind for kind in ours if isinstance(getattr(kind, "name", None), str)]
    return [kind(*ASKED.get(kind, ())) for kind in named]


@pytest.mark.parametrize("measure", every_measure(), ids=lambda measure: measure.name)
def test_each_number_is_described_once(measure):
    """Each output is described by its measure or by the vocabulary.

    The description of an error refers to the output.
    """
    own = {about.name: about for about in measure.quantities}
    assert len(own) == len(measure.quantities)
    assert own.keys() & vocabulary.QUANTITY_BY_NAME.keys() <= SHARED
    for name in (*measure.variables, *measure.output_coordinates):
        nothing_said = Quantity(name, "", "1", name.replace("_", " "))
        assert vocabulary.find_quantity(name, own) != nothing_said


@pytest.mark.parametrize("measure", every_measure(), ids=lambda measure: measure.name)
def test_no_outcome_is_ok_without_a_number_that_has_an_error(measure, monkeypatch):
    """An outcome with missing or NaN outputs does not have the status OK.

    Outputs with error estimates must be finite unless the measure declares them optional.
    The errors in this test are small, because errors of 1 would exceed the requested
    accuracy.
    """
    whole = {
        name: np.full([len(measure.output_coordinates[dim]) for dim in dims], 2.0 + number)
        if dims
        else 2.0 + number
        for number, (name, dims) in enumerate(measure.variables.items())
    }
    whole |= {n: 1e-9 * value for n, value in whole.items() if n.endswith("_error")}
    scene = Scene(load_velocity_ratio=2.0)
    if isinstance(measure, NormalStressResponse):
        oscillates = {"oscillation_amplitude": 0.01, "oscillation_period": 10.0}
        scene = Scene(normal_stress="imposed", **oscillates)

    def ended(values) -> Status:
        monkeypatch.setattr(type(measure), "compute", lambda *_asked: Outcome(Status.OK, values))
        return measure(scene, Accuracy()).status

    assert ended(whole) is Status.OK
    assert measure.primary_output in whole
    assert set(measure.optional_output_names) <= set(measure.names_of_outputs_with_error)
    for name in measure.names_of_outputs_with_error:
        for missing in (name, f"{name}_error"):
            assert ended({**whole, missing: whole[missing] * math.nan}) is Status.NOT_FINITE
        rest = {n: v for n, v in whole.items() if n not in (name, f"{name}_error")}
        may_lack = name in measure.optional_output_names
        assert ended(rest) is (Status.OK if may_lack else Status.NOT_FINITE)
