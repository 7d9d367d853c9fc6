"""Tests of invalid user-defined measures.

Invalid declarations are rejected before any work, and invalid outcomes lead to failed cells
with a message.
"""

import re

import numpy as np
import pytest
from study_runs import run, run_with_failures

import rsfstudy
from rsfstudy import Axis, Scene, Study
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure, Outcome
from rsfstudy.quantities import Output, Quantity
from rsfstudy.status import Status


def named(value: object) -> str:
    """Return a test id without memory addresses, equal in all processes."""
    return re.sub(" at 0x[0-9a-f]+", "", repr(value))[:80]


class Own(Measure):
    """Measure that returns b/a."""

    name = "own"
    primary_output = "total"
    variables = {"total": ()}  # noqa: RUF012
    typical_rhs_evaluations = 1

    def compute(self, scene, integrator):
        integrator.work_meter.charge("any", 7)
        return Outcome(Status.OK, {"total": scene.b_over_a})


def study(measure, **parts):
    axes = [Axis("b_over_a", [2.0, 3.0])]
    return Study(name="own", title="Own", base=Scene(), axes=axes, measure=measure, **parts)


def own(**declared) -> Measure:
    """Return a measure with other declarations."""
    return type("Own", (Own,), declared)()


def along(values) -> Measure:
    """Return a measure with an inner dimension."""
    return own(variables={"total": (), "curve": ("x",)}, output_coordinates={"x": values})


# ---- its numbers have units ---------------------------------------------------------------------


class Outputs(Measure):
    """Measure that returns b/a as a stress and a curve, and its logarithm.

    The logarithm is missing in some cells.
    """

    name = "outputs"
    primary_output = "total"
    outputs = (
        Output("total", "$Q$", "1", "heat per area", "sigma_*", error=True),
        Output("curve", dims=("x",)),
        Output("logarithm", error=True, optional=True),
        Output("slip_per_event"),
    )
    dimensions = (Quantity("x", "", "m", "distance along the fault"),)
    output_coordinates = {"x": [1.0, 2.0]}  # noqa: RUF012
    typical_rhs_evaluations = 1

    def compute(self, scene, integrator):
        ratio = scene.b_over_a
        values = {"total": ratio, "total_error": 0.0, "curve": np.ones(2), "slip_per_event": 1.0}
        if ratio > 2.0:
            values |= {"logarithm": np.log(ratio), "logarithm_error": 1e-16}
        return Outcome(Status.OK, values)


def test_a_measure_states_its_outputs_once(tmp_path):
    """The attributes of a file follow from the declared outputs."""
    measure = Outputs()
    assert dict(measure.variables) == {
        "total": (),
        "total_error": (),
        "curve": ("x",),
        "logarithm": (),
        "logarithm_error": (),
        "slip_per_event": (),
    }
    assert (*measure.names_of_outputs_with_error, *measure.optional_output_names) == (
        "total",
        "logarithm",
        "logarithm",
    )
    dataset = run(study(measure), output=tmp_path)
    assert (dataset.status == int(Status.OK)).all()
    np.testing.assert_array_equal(dataset.logarithm, [np.nan, np.log(3.0)])
    said = {"long_name": "heat per area", "symbol": "$Q$", "units": "1", "scale": "sigma_*"}
    assert said.items() <= dataset.total.attrs.items()
    assert dataset.total.attrs["ancillary_variables"] == "total_error status"
    error = dataset.total_error.attrs
    assert error["long_name"] == "numerical error estimate of heat per area"
    assert (error["units"], error["scale"]) == ("1", "sigma_*")
    assert dataset.x.attrs["long_name"] == "distance along the fault"
    assert dataset.curve.attrs["long_name"] == "curve"
    # The vocabulary describes outputs that are declared by name only.
    assert dataset.slip_per_event.attrs["long_name"] == "slip per stick-slip cycle"


# ---- what no lattice can hold -------------------------------------------------------------------


@pytest.mark.parametrize(
    "values",
    [
        np.ones((2, 2)), np.float64(3.0), [], [[1.0], [1.0, 2.0]], [1.0, np.nan], [1.0, np.inf],
        [1.0, 1.0], ["a", "a"], ["a", "b\0c"], ["a", "\udc80"], [1.0, 2j], [1.0, None],
        np.array([object(), 1.0]), np.array([1.0, 2.0], dtype=object),
        np.array([1.0, 2.0], dtype=np.longdouble), np.array([1.0, 2.0], dtype=np.float16),
        np.array(["2020-01-01", "2020-01-02"], dtype="M8[ns]"), np.array([1, 2], dtype="m8[ns]"),
        np.ma.masked_array([1.0, 2.0], [False, True]), {"a": 1.0}, "ab", None, 3,
    ],
    ids=named,
)  # fmt: skip
def test_inner_coordinates_that_are_none(values):
    with pytest.raises(
        InvalidValue,
        match="^'x' must |^declaration of measure 'Own' is invalid and cannot be stored",
    ):
        study(along(values))


@pytest.mark.parametrize(
    "values",
    [[0.0, 1.0], range(2), np.array([1, 2**63], dtype=np.uint64), ["a", "b"], np.array(["a", "é"])],
    ids=named,
)
def test_inner_coordinates_that_a_file_gives_back(values, tmp_path):
    class Curve(Own):
        variables = {"total": (), "curve": ("x",)}  # noqa: RUF012
        output_coordinates = {"x": values}  # noqa: RUF012

        def compute(self, scene, integrator):
            return Outcome(Status.OK, {"total": 1.0, "curve": [3, 4]})

    run(study(Curve()), output=tmp_path)
    back = rsfstudy.open("own", tmp_path)
    assert back["x"].values.tolist() == np.asarray(values).tolist()
    assert back["curve"].values.tolist() == [[3.0, 4.0]] * 2


# ---- outcomes that cannot be --------------------------------------------------------------------


@pytest.mark.parametrize("count", [2**63, -1, -(2**70), 1.5, np.nan, "many"])
def test_work_that_is_no_count(count, tmp_path):
    """Cells with an invalid work count fail with a message in the file."""

    def compute(self, scene, integrator):
        integrator.work_meter.evaluations = count
        return Outcome(Status.OK, {"total": 1.0})

    run_with_failures(study(own(compute=compute)), output=tmp_path)
    found = rsfstudy.open("own", tmp_path)
    assert found["status"].values.tolist() == [Status.CELL_RAISED] * 2
    assert "must be a whole number from 0 to 2**63 - 1" in found["message"].values[0]
