"""Tests of the comparison of two results files.

The comparison covers declarations, provenance, statuses and numbers, with error estimates
as tolerances. Cells are matched by their coordinates.
"""

import json
from dataclasses import replace

import pytest
from study_runs import call_main, run, study_of

import rsfstudy
from rsfstudy import Axis, Scene
from rsfstudy.errors import InvalidValue
from rsfstudy.reductions import LinearFit
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.status import Status
from rsfstudy.storage import dataset_files

NUMBER = "critical_stiffness"
RATIOS = [1.5, 2.0, 2.5, 3.0]


def study(*axes, measure=None, **fields):
    return study_of(
        "stiffness",
        measure or LinearStability(),
        *axes,
        Axis("b_over_a", RATIOS),
        base=Scene(**fields),
    )


@pytest.fixture(scope="module")
def computed():
    return run(study(Axis("law", ["slip", "slowness"])))


@pytest.fixture
def two(computed):
    return computed.copy(deep=True), computed.copy(deep=True)


def row(found, name=NUMBER):
    return found.agreement_table.set_index("variable").loc[name]


def test_the_same_agree(two):
    found = rsfstudy.compare(*two)
    assert found.agrees
    assert found.finished_cell_counts == (8, 0, 0)
    assert (found.agreement_table["values"] == found.agreement_table["identical"]).all()
    assert (
        found.differing_declaration_entries,
        found.differing_provenance,
        found.differing_axis_points,
        found.uncompared_variables,
    ) == ({}, {}, {}, {})


@pytest.mark.parametrize(("part", "beyond"), [(0.9, 0), (1.1, 1)])
def test_numbers_are_held_against_the_sum_of_both_errors(two, part, beyond):
    first, second = two
    first[f"{NUMBER}_error"][1, 2], second[f"{NUMBER}_error"][1, 2] = 1e-5, 3e-5
    second[NUMBER][1, 2] += part * 4e-5
    found = rsfstudy.compare(first, second)
    assert row(found)["beyond_errors"] == beyond
    assert row(found)["identical"] == 7
    assert row(found)["largest_difference"] == pytest.approx(part * 4e-5)
    assert found.agrees == (not beyond)


def test_statuses_that_differ_are_named(two):
    two[1]["status"][1, 0] = int(Status.NO_STEADY_STATE)
    found = rsfstudy.compare(*two)
    assert not found.agrees
    (ended,) = found.differing_statuses.to_dict("records")
    assert ended == {
        "law": "slowness",
        "b_over_a": 1.5,
        "first": "ok",
        "second": "no_steady_state",
    }


def test_codes_are_compared_though_they_have_no_errors(two):
    first, second = two
    codes = {"flag_values": [0.0, 1.0], "flag_meanings": "slow fast"}
    for dataset, code in ((first, 0.0), (second, 1.0)):
        dataset["mode"] = dataset[NUMBER].copy(data=dataset[NUMBER].values * 0.0 + code)
        dataset["mode"].attrs = codes
    assert rsfstudy.compare(first, first).agrees
    assert rsfstudy.compare(first, second).variables_differing_beyond_errors == ["mode"]


def test_points_of_one_name_must_hold_the_same(two):
    """Points with equal names but different values are rejected.

    For example, two sets of random samples contain different cells.
    """
    first, second = two
    values = ("b_over_a", [0.5, 0.6, 0.7, 0.8])
    first = first.assign_coords(alpha=values)
    rounded = first.assign_coords(alpha=first["alpha"] * (1.0 + 1e-15))
    assert rsfstudy.compare(first, rounded).agrees
    with pytest.raises(InvalidValue, match="different values of alpha") as caught:
        rsfstudy.compare(first, second.assign_coords(alpha=first["alpha"] + 0.1))
    assert caught.value.name == "axis"


def test_cells_are_matched_by_their_places(two):
    """Cells are matched by coordinates, in any order and despite rounding.

    Cells without a match are counted and named.
    """
    first, second = two
    second = second.isel(b_over_a=[3, 1, 0], law=[1])
    second = second.assign_coords(b_over_a=second.b_over_a * (1.0 + 2e-16))
    first = first.isel(b_over_a=[0, 1, 2])
    found = rsfstudy.compare(first, second)
    assert found.finished_cell_counts == (2, 4, 1)
    assert row(found)["identical"] == 2
    assert found.differing_axis_points["law"] == (["slip"], [])
    assert found.differing_axis_points["b_over_a"] == ([2.5], pytest.approx([3.0]))
    assert found.agrees


def test_an_axis_that_the_other_lacks_is_matched_by_its_fixed_value(computed):
    fixed = run(study(law="slowness"))
    for pair in ((computed, fixed), (fixed, computed)):
        found = rsfstudy.compare(*pair)
        assert sorted(found.finished_cell_counts) == [0, 4, 4]
        assert row(found)["identical"] == 4
    named = study(Axis("case", {"one": {"law": "slip"}, "two": {"law": "slowness"}}))
    with pytest.raises(InvalidValue, match="axis 'case' is an axis of only one of the datasets"):
        rsfstudy.compare(fixed, run(named))


def test_reductions_of_other_cells_are_left_out(computed):
    whole = study(Axis("law", ["slip", "slowness"]))
    fit = LinearFit(name="slope", of=NUMBER, on="b_over_a")
    whole = replace(whole, reductions=[fit])
    first, second = run(whole), run(whole.with_(b_over_a=RATIOS[:3]))
    assert "slope" in rsfstudy.compare(first, second).uncompared_variables
    assert "slope" in set(rsfstudy.compare(first, first).agreement_table["variable"])
    fewer = run(whole.with_(law=["slip"]))
    assert row(rsfstudy.compare(first, fewer), "slope")["values"] == 1


def test_declaration_and_origin(two):
    first, second = two
    about = json.loads(second.attrs["provenance"])
    about["versions"]["numpy"] = "0.1"
    about["machine"] = "an abacus"
    declared = json.loads(second.attrs["declaration"])
    declared["accuracy"]["rtol"] = 1e-5
    changed = {"provenance": json.dumps(about), "declaration": json.dumps(declared)}
    found = rsfstudy.compare(first, second.assign_attrs(changed))
    assert found.differing_declaration_entries == {"accuracy.rtol": (1e-7, 1e-5)}
    assert found.differing_provenance["machine"][1] == "an abacus"
    assert found.agrees


# ---- the command --------------------------------------------------------------------------------


@pytest.fixture
def files(two, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "120")
    first, second = two
    second[NUMBER][0, 1] += 1e-3
    second["status"][1, 0] = int(Status.NO_STEADY_STATE)
    places = tmp_path / "first.nc", tmp_path / "second.nc"
    for dataset, place in zip((first, second.isel(b_over_a=[0, 1])), places, strict=True):
        dataset_files.write_dataset(dataset, place)
    return places


def test_the_command_says_what_differs(files):
    ran = call_main("compare", *files)
    assert ran.returncode == 1, ran.stderr
    for words in (
        "4 cells in both, 4 only in A, 0 only in B",
        "b_over_a only in A (2): 2.5,3",
        "law = slowness, b_over_a = 1.5",
        "no_steady_state",
        f"{NUMBER} differs beyond error estimates; 1 cell with different statuses",
    ):
        assert words in ran.stdout


def test_the_command_says_that_nothing_differs(files):
    ran = call_main("compare", files[0], files[0])
    assert ran.returncode == 0, ran.stderr
    assert "nothing differs beyond error estimates" in ran.stdout


def test_exit_statuses(files, tmp_path):
    assert call_main("compare", files[0]).returncode == 2
    assert call_main("compare", files[0], "nothing").returncode == 2
    assert call_main("compare", files[0], tmp_path / "missing.nc").returncode == 1
