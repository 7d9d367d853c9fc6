"""Tests of axes over fields of a measure.

The cells are computed, stored, found again, selected, compared with claims and reproduced
in the same way as for fields of the scene.
"""

from contextlib import nullcontext
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
import xarray as xr
from study_runs import (
    USER_MEASURE_SOURCE,
    call_main,
    example_claim,
    have_same_numbers,
    record_computed_cells,
    run,
    study_of,
)

import rsfstudy
from rsfstudy import Axis, Scene, Study
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.errors import DataError, InvalidValue, NoResultWarning
from rsfstudy.execution.cell_plan import CellPlan
from rsfstudy.measures import Measure, Outcome
from rsfstudy.status import Status
from rsfstudy.storage import schema, study_reconstruction

BOTH = study_of(
    "both",
    CriticalStep(of="displacement_step"),
    Axis("direction", ["up", "down"]),
    Axis("b_over_a", [2.0, 3.0]),
    base=Scene(normal_stress="constant"),
)


@dataclass(frozen=True)
class Scaled(Measure):
    """Measure that returns b/a times a factor, with further options."""

    factor: float = 1
    times: int = 1
    negative: bool = False
    unit: str = "one"
    table: tuple[float, ...] = (1.0,)
    name: ClassVar[str] = "scaled"
    primary_output: ClassVar[str] = "total"
    variables: ClassVar = {"total": ()}
    typical_rhs_evaluations: ClassVar[int] = 1

    def __post_init__(self):
        if self.factor == 13.0:
            raise RuntimeError("no luck")

    def compute(self, scene, integrator):
        total = sum(self.factor * scene.b_over_a for _ in range(self.times))
        return Outcome(Status.OK, {"total": -total if self.negative else total})


def scaled(*axes: Axis, **fields) -> Study:
    axes = (*axes, Axis("b_over_a", [2.0, 3.0]))
    return Study(**{"name": "scaled", "title": "Scaled", "base": Scene(), "axes": axes,
                    "measure": Scaled(), **fields})  # fmt: skip


def test_each_cell_is_measured_as_the_axis_says():
    """Each cell equals a single call with the fields of the axis.

    Upward steps trigger instability in these scenes, and downward steps do not.
    """
    found = run(BOTH).isel(b_over_a=0)
    for direction, told in (("up", nullcontext()), ("down", pytest.warns(NoResultWarning))):
        with told:
            step = rsfstudy.critical_step(
                BOTH.scene(0), of="displacement_step", direction=direction
            )
        ours = found.sel(direction=direction)
        assert Status(int(ours.status)).label == step.attrs["status"]
        for name in step.data_vars:
            np.testing.assert_array_equal(ours[name], step[name])
    statuses = [Status.OK, Status.STABLE_FOR_ALL_STEPS]
    assert found.status.values.tolist() == statuses


def test_numbers_flags_and_texts_of_a_measure_of_ones_own():
    """Fields of a user-defined measure keep their types.

    An integer default of a float field permits fractions.
    """
    axes = [Axis("factor", [0.5, 2]), Axis("times", [1, 3]), Axis("negative", [False, True])]
    found = run(scaled(*axes, Axis("unit", ["one", "two"])))
    assert found.total.dims == ("factor", "times", "negative", "unit", "b_over_a")
    place = {"factor": 0.5, "times": 3, "negative": 1, "unit": "two", "b_over_a": 3.0}
    assert float(found.total.sel(place)) == -0.5 * 3 * 3.0
    assert found.negative.attrs["flag_meanings"] == "false true"
    assert "units" not in found.unit.attrs
    assert found.times.attrs["units"] == "1"


def test_a_point_of_a_zipped_axis_sets_both():
    case = Axis("case", {"plain": {"a": 0.01}, "twice": {"a": 0.02, "factor": 2.0}})
    found = run(scaled(case))
    assert found.total.values.tolist() == [[2.0, 3.0], [4.0, 6.0]]
    assert found["factor"].values.tolist() == [1.0, 2.0]
    assert found["a"].values.tolist() == [0.01, 0.02]
    assert run(scaled(case).with_(factor=[2.0, 4.0])).total.sel(case="factor = 4")[0] == 8.0


def test_the_same_on_workers_and_in_pieces(tmp_path, cluster):
    have_same_numbers(run(BOTH, client=cluster), run(BOTH))
    run(BOTH, output=tmp_path, format="zarr")
    have_same_numbers(rsfstudy.open(tmp_path / "both.zarr"), run(BOTH))


def test_overrides_change_the_measure():
    fixed = scaled().with_(factor=3.0)
    assert fixed.measure == Scaled(factor=3.0)
    assert run(fixed).total.values.tolist() == [6.0, 9.0]
    assert scaled().with_(times=2.0).measure.times == 2
    axis = scaled().with_(factor=[1.0, 3.0])
    assert axis.dimensions == ("factor", "b_over_a")
    assert axis.with_(factor=5.0).shape == (1, 2)


def test_a_field_that_decides_the_shape_is_refused():
    kind = type("Long", (Scaled,), {
        "variables": {"total": (), "row": ("place",)},
        "output_coordinates": property(lambda self: {"place": np.arange(float(self.times))}),
    })  # fmt: skip
    assert scaled(Axis("factor", [1.0, 2.0]), measure=kind()).shape == (2, 2)
    with pytest.raises(
        InvalidValue,
        match="field 'times' cannot vary along an axis.*Create a separate study for each",
    ):
        scaled(Axis("times", [1.0, 2.0]), measure=kind())


def computed_by(study: Study, output) -> int:
    """Return the number of cells that a run computes."""
    with record_computed_cells() as asked:
        run(study, output=output)
    return len(asked)


def test_cells_are_found_again_by_the_fields_of_their_measure(tmp_path):
    assert computed_by(scaled(Axis("factor", [1.0, 2.0])), tmp_path) == 4
    assert computed_by(scaled(Axis("factor", [2.0, 1.0, 4.0])), tmp_path) == 2
    assert computed_by(scaled(measure=Scaled(factor=4.0)), tmp_path) == 0
    assert computed_by(scaled(measure=Scaled(factor=8.0)), tmp_path) == 2
    assert run(scaled(measure=Scaled(factor=4.0)), output=tmp_path).total[0] == 8.0
    with pytest.raises(
        DataError, match="contains cells that were computed with other settings .measure: .*table"
    ):
        run(scaled(measure=Scaled(table=(2.0,))), output=tmp_path)


def test_cells_differ_even_where_a_measure_does_not_say_so():
    silent = type("Silent", (Scaled,), {"describe": lambda self: {"name": "silent"}})
    assert (
        len(CellPlan(scaled(Axis("factor", [1.0, 2.0]), measure=silent())).unique_cell_numbers) == 4
    )


def test_claims_and_selection_reach_a_place_on_the_axis():
    claim = example_claim(
        id="X1",
        variable="critical_displacement_stable",
        published=0.0,
        tolerance=0.0,
        relation="below",
        where={"direction": "down", "b_over_a": 2.0},
    )
    declared = replace(BOTH, claims=[claim])
    assert rsfstudy.check(run(declared)).verdict.tolist() == ["reproduced"]
    assert rsfstudy.check(run(declared.with_(direction="up"))).verdict.tolist() == [
        "not applicable"
    ]
    with pytest.raises(InvalidValue, match="claim X1: 'where' must be a point of the lattice"):
        run(replace(declared, claims=[replace(claim, where={"direction": "left"})]))


def test_the_file_alone_reproduces_its_cells(tmp_path):
    found = run(BOTH, output=tmp_path).sel(direction="down", b_over_a=3.0)
    file = tmp_path / "both.nc"
    restored = study_reconstruction.build_study_from_declaration(
        schema.read_study_declaration(rsfstudy.open(file)), {}
    )
    assert restored.describe() == BOTH.describe()
    xr.testing.assert_identical(
        xr.Dataset(coords=CellPlan(restored).lattice_coordinates),
        xr.Dataset(coords=CellPlan(BOTH).lattice_coordinates),
    )
    table = rsfstudy.rerun(file, workers=0, progress=False)
    assert (table["values"] == table["identical"]).all()
    _scene, outcome = rsfstudy.recompute_cell(file, {"direction": "down", "b_over_a": 3.0})
    assert outcome.values["critical_displacement_stable"] == found.critical_displacement_stable


def test_a_study_file_with_a_measure_of_its_own(tmp_path, monkeypatch):
    """A user-defined measure is sent to workers that cannot import it.

    A failed cell is listed with its coordinates.
    """
    file = tmp_path / "own.py"
    file.write_text(USER_MEASURE_SOURCE)
    monkeypatch.setenv("COLUMNS", "500")
    words = ["--workers", "1", "--output", tmp_path, "--quiet"]
    ran = call_main("run", file, "--set", "power=2,3,4", *words)
    assert ran.returncode == 1
    assert "--cell power=4.0 --cell b_over_a=2.0" in ran.stdout
    found = rsfstudy.open(tmp_path / "own.nc")
    assert found.total.sel(power=[2.0, 3.0]).values.tolist() == [[4.0, 9.0], [8.0, 27.0]]
    place = ["--cell", "power=3", "--cell", "b_over_a=3"]
    alone = call_main("rerun", tmp_path / "own.nc", "--study", file, *place)
    assert alone.returncode == 0
    assert ["total", "27.0", "same"] in [line.split() for line in alone.stdout.splitlines()]


def test_a_measure_of_its_own_is_computed_anew_as_it_was_set(tmp_path):
    file = tmp_path / "own.py"
    file.write_text(USER_MEASURE_SOURCE)
    rsfstudy.run(file, workers=0, output=tmp_path, progress=False, offset=0.5)
    assert rsfstudy.open(tmp_path / "own.nc").total.values.tolist() == [[2.5, 3.5], [4.5, 9.5]]
    table = rsfstudy.rerun(tmp_path / "own.nc", study=file, workers=0, progress=False)
    assert (table["values"] == table["identical"]).all()
    place = {"power": 2, "b_over_a": 3}
    _scene, outcome = rsfstudy.recompute_cell(tmp_path / "own.nc", place, study=file)
    assert outcome.values["total"] == 9.5
