"""Tests of study declarations: axes, zipped axes, overrides and errors."""

import pickle
from dataclasses import dataclass

import numpy as np
import pytest
from study_runs import cell_key

import rsfstudy
from rsfstudy import Axis, Claim, Scene, Study, check
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.errors import InvalidValue
from rsfstudy.execution import cell_computation
from rsfstudy.execution.cell_plan import CellPlan
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.slider.laws.slip import SlipLaw
from rsfstudy.slider.parts import number
from rsfstudy.storage import study_reconstruction
from rsfstudy.study import named_study_index, study_loader

CASES = {
    "constant": {"normal_stress": "constant"},
    "weak": {"normal_stress": "variable", "alpha": 0.25},
    "strong": {"normal_stress": "variable", "alpha": 0.56},
}


def study(*axes: Axis, **fields) -> Study:
    return Study(
        name="trial", title="Trial", base=Scene(), axes=axes, measure=CriticalStep(), **fields
    )


def test_cells_run_over_the_last_axis_first():
    declared = study(Axis("case", CASES), Axis("b_over_a", [2.0, 3.0]))
    assert (declared.dimensions, declared.shape, declared.size) == (("case", "b_over_a"), (3, 2), 6)
    cells = [(s.normal_stress, s.alpha, s.b_over_a) for s in declared.scenes()]
    assert cells[:3] == [
        ("constant", None, 2.0),
        ("constant", None, 3.0),
        ("variable", 0.25, 2.0),
    ]


def test_values_that_do_not_apply_are_left_out_of_constant_normal_stress():
    declared = study(Axis("normal_stress", ["constant", "variable"]), Axis("phi", [50.0, 60.0]))
    assert [s.phi for s in declared.scenes()] == [None, None, 50.0, 60.0]


def test_override_of_an_axis_replaces_its_values():
    changed = study(Axis("b_over_a", [2.0, 3.0])).with_(b_over_a=[4, np.float64(5.0)])
    assert [s.b_over_a for s in changed.scenes()] == [4.0, 5.0]
    assert study(Axis("b_over_a", [2.0, 3.0])).with_(b_over_a=7).shape == (1,)


def test_a_list_for_a_fixed_value_makes_an_axis():
    changed = study(Axis("b_over_a", [2.0, 3.0])).with_(phi=[50, 60, 70])
    assert changed.dimensions == ("phi", "b_over_a")
    assert changed.shape == (3, 2)


def test_override_along_a_zipped_axis_touches_only_the_points_that_use_it():
    changed = study(Axis("case", CASES)).with_(alpha=[0.1, 0.4])
    assert [s.alpha for s in changed.scenes()] == [None, 0.1, 0.4]
    assert study(Axis("case", CASES)).with_(alpha=0.3).shape == (2,)


def test_an_override_that_other_points_take_from_the_base_is_refused():
    """An override must not apply to some points of a zipped axis only.

    The other points would keep the base value, although the override is listed as applied.
    A selection of points takes precedence.
    """
    points = {"two laws": {"law": "slip"}, "neutral": {"law": "slowness", "b_over_a": 1.0}}
    laws = declared(base=Scene(stiffness=0.01), axes=[Axis("case", points)])
    with pytest.raises(
        InvalidValue, match="only at some points of case .neutral.*two laws, which is 2"
    ):
        laws.with_(b_over_a=1.6)
    for given in ({"b_over_a": 1.6, "case": "two laws"}, {"case": "two laws", "b_over_a": 1.6}):
        (scene,) = laws.with_(**given).scenes()
        assert (scene.law, scene.b_over_a) == ("slip", 1.6)
    (neutral,) = laws.with_(b_over_a=0.9, case="neutral").scenes()
    assert neutral.b_over_a == 0.9


def test_labels_select_points():
    assert [s.alpha for s in study(Axis("case", CASES)).with_(case=["strong"]).scenes()] == [0.56]
    with pytest.raises(InvalidValue, match="Did you mean 'strong'"):
        study(Axis("case", CASES)).with_(case="strongg")


def test_points_keep_their_labels_where_they_keep_their_values():
    declared = study(Axis("case", {"constant": CASES["constant"], "alpha = 0.25": CASES["weak"]}))
    changed = declared.with_(alpha=[0.25, 0.4])
    assert changed.axes[0].labels == ("constant", "alpha = 0.25", "alpha = 0.4")
    both = study(Axis("case", CASES)).with_(alpha=[0.25, 0.4, 0.56])
    assert [s.alpha for s in both.scenes()] == [None, 0.25, 0.4, 0.56]


def declared(**fields) -> Study:
    common = {"axes": [Axis("b_over_a", [2.0])], "measure": CriticalStep()}
    return Study(**{"name": "trial", "title": "Trial", "base": Scene(), **common, **fields})


@pytest.mark.parametrize("order", [["constant", "variable"], ["variable", "constant"]])
def test_a_zipped_axis_bears_its_own_values_whatever_the_first_cell_needs(order):
    case = Axis("case", {"weak": {"alpha": 0.25}, "strong": {"alpha": 0.5}})
    study = declared(axes=[Axis("normal_stress", order), case])
    assert CellPlan(study).lattice_coordinates["alpha"][1].tolist() == [0.25, 0.5]


def test_coordinates_are_taken_from_the_scenes_of_the_plan(monkeypatch, tmp_path):
    """Neither the run of a study nor the check of its file builds a scene for the coordinates."""
    cases = Axis("case", {"weak": {"alpha": 0.25}, "steady": {"normal_stress": "constant"}})
    axes = [Axis("b_over_a", [1.5, 2.0]), cases]
    study = declared(axes=axes, measure=LinearStability())
    monkeypatch.setattr(Study, "cell", None)
    rsfstudy.run(study, output=tmp_path, workers=0, progress=False)
    found = rsfstudy.open(tmp_path / "trial.nc")
    assert study_reconstruction.rebuild_study(found).describe() == study.describe()
    assert found.normal_stress.values.tolist() == ["variable", "constant"]
    assert found.alpha.values.tolist() == pytest.approx([0.25, np.nan], nan_ok=True)
    assert (found.b_over_a.dims, found.law.item()) == (("b_over_a",), "slip")
    assert "fluid" in found.coords
    assert "dilatancy" not in found.coords


def test_claims_on_a_point_apply_if_its_value_is_given_again():
    """A claim on a labelled point is checked for any list with its value."""
    place = {"case": "alpha = 0.5", "b_over_a": 2.0}
    claim = Claim(
        id="C1",
        statement="critical stiffness falls with alpha",
        source="closed form",
        published=1.0,
        tolerance=10.0,
        reason="any finite number",
        variable="critical_stiffness",
        where=place,
    )
    points = {name: {"normal_stress": "variable", "alpha": a} for name, a in _ALPHAS.items()}
    stability = declared(
        axes=[Axis("case", points), Axis("b_over_a", [2.0, 3.0])],
        measure=LinearStability(),
        claims=[claim],
    )
    for values in ([0.5], [0.1, 0.5], [0.5, 0.3]):
        dataset = rsfstudy.run(stability, alpha=values, workers=0, output=None, progress=False)
        assert check(dataset).verdict.tolist() == ["reproduced"]


#: Labels and values of the points of a zipped axis.
_ALPHAS = {"alpha = 0.25": 0.25, "alpha = 0.5": 0.5}


def test_a_new_value_does_not_take_the_place_of_a_point_with_its_name():
    points = {
        "first": {"alpha": 0.56, "stiffness_ratio": 2.0},
        "alpha = 0.25": {"alpha": 0.25, "stiffness_ratio": 1.0},
    }
    (axis,) = declared(axes=[Axis("case", points)]).with_(alpha=[0.25]).axes
    assert [row["stiffness_ratio"] for row in axis.rows] == [2.0, 1.0]
    assert axis.labels == ("first, alpha = 0.25", "alpha = 0.25")


@pytest.mark.parametrize(
    "values", [[0.25], [0.56], [0.25, 0.56], [0.56, 0.25], [0.56, 0.3], [np.float64(0.56), 0.3]]
)
def test_labels_of_existing_points_do_not_depend_on_the_list_of_values(values):
    (axis, _other) = study_loader.load_study("rate_step_boundary").with_(alpha=values).axes
    assert axis.labels == ("constant normal stress", *(f"alpha = {value}" for value in values))
    assert [row.get("alpha") for row in axis.rows] == [None, *values]


@pytest.mark.parametrize("given", [0.1, [0.1, 1.0], [1, 0.1], [0.1, 0.1 + 1e-12]])
def test_new_labels_identify_their_points(given):
    """New labels are unique even if several points have the same value.

    The points differ in other fields.
    """
    points = {
        "held, alpha = 0": {"normal_stress": "imposed", "alpha": 0.0},
        "held, alpha = 0.5": {"normal_stress": "imposed", "alpha": 0.5},
        "coupled": {"normal_stress": "variable", "alpha": 0.5},
    }
    (axis,) = study(Axis("case", points)).with_(alpha=given).axes
    names = {"imposed": "held", "variable": "coupled"}
    values = given if isinstance(given, list) else [given]
    texts = {1.0: "1", 0.1: "0.1"}
    assert axis.labels == tuple(
        f"{names[condition]}, alpha = {texts.get(value, repr(value))}"
        for condition in names
        for value in values
    )
    expected = [(condition, value) for condition in names for value in values]
    assert [(row["normal_stress"], row["alpha"]) for row in axis.rows] == expected


# ---- cells as columns of numbers -----------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Twofold(SlipLaw):
    """A law that changes its field in ``__post_init__``."""

    given: float = number(1.0, "", "1", "a number")

    name = "twofold"

    def __post_init__(self) -> None:
        object.__setattr__(self, "given", 2.0 * self.given)


MIXED = Study(
    name="mixed",
    title="Cells of many kinds",
    base=Scene(),
    axes=[
        Axis("law", ["slip", "slowness", Twofold]),
        Axis(
            "case",
            {
                "constant": {"normal_stress": "constant"},
                "no effect": {"alpha": 0.0},
                "heavy": {"alpha": 0.3, "inertia": True},
                "held": {"displacement_step": 2.0},
            },
        ),
        Axis("load_velocity_ratio", [0.0, 0.5, 2.0]),
        Axis("events", [50, 300]),
    ],
    measure=LimitCycle(),
)


@pytest.mark.parametrize("name", ["mixed", *named_study_index.list_study_names()])
def test_a_worker_computes_the_cells_of_the_declaration(name, monkeypatch):
    """A worker reconstructs each cell from its key and its changes.

    Large lattices are sampled.
    """
    study = MIXED if name == "mixed" else study_loader.load_study(name)
    plan = CellPlan(study)
    numbers = np.unique(np.linspace(0, study.size - 1, 72).astype(int))
    cell_settings = cell_computation.SharedCellSettings(study.base, study.measure, study.accuracy)
    monkeypatch.setattr(cell_computation, "_load_cell_settings", lambda _sent: cell_settings)
    monkeypatch.setattr(cell_computation, "_SECONDS_BETWEEN_JOURNAL_TRANSFERS", np.inf)
    monkeypatch.setattr(cell_settings.output_packer, "pack_journal_row", lambda *finished: finished)
    monkeypatch.setattr(cell_computation, "compute_cell", lambda _cell_settings, cell: (cell, 0.0))
    found = pickle.loads(
        cell_computation.compute_packed_cell_batch(
            b"", cell_computation.pack_cell_batch(plan, numbers)
        )
    )
    for place, (key, cell, _seconds) in zip(numbers.tolist(), found, strict=True):
        scene, changes = study.cell(place)
        assert plan.keys[place].tobytes() == key
        assert cell_key(scene, study.measure.with_(**changes)) == key
        assert cell == (scene, changes)
        assert cell.scene.parameter_values == scene.parameter_values
