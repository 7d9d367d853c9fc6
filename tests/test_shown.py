"""Tests of HTML tables in notebooks, and of numbers in the terminal."""

import io
import math
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy.stats import norm, uniform
from study_runs import call_main, run, study_of

import rsfstudy
from rsfstudy import Axis, Scene, Study
from rsfstudy.cli.console_output import LiteralTextConsole
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.errors import IncompleteWarning
from rsfstudy.quantities import HtmlText, format_symbol_as_html
from rsfstudy.reductions import SobolIndices, StatusShares
from rsfstudy.reporting import lattice_tables, reduction_tables
from rsfstudy.reporting.text_tables import build_single_scene_result_table, format_rounded_to_error
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.status import Status
from rsfstudy.storage import dataset_files, study_reconstruction
from rsfstudy.study import study_loader
from rsfstudy.study.claim_verdict_table import ClaimVerdictTable
from rsfstudy.study.claims import Claim, build_verdict_table


def rows(html):
    """Return the text of each table row, and assert that it is well-formed."""
    tree = ElementTree.fromstring(f"<div>{html}</div>")
    return [["".join(cell.itertext()) for cell in row] for row in tree.iter("tr")]


def test_a_scene_states_symbol_value_unit_and_meaning():
    shown = rows(Scene(hold_time=100.0, normal_stress="constant")._repr_html_())
    assert shown[0] == ["field", "symbol", "value", "unit", "meaning"]
    by_name = {row[0]: row[1:] for row in shown}
    assert by_name["b_over_a"][:2] == ["b/a", f"{Scene().b_over_a:g}"]
    assert by_name["hold_time"][1:] == ["100", "Dc/V*", by_name["hold_time"][3]]
    assert by_name["reference_rate"][2] == "s-1"
    assert by_name["inertia"][1] == "no"
    assert "phi" not in by_name  # without meaning at constant normal stress


def test_a_study_states_its_axes_and_what_all_cells_share():
    study = Study(
        name="angles",
        title="Angles < 90",
        base=Scene(law="slip", a=0.011),
        axes=[Axis("phi", np.linspace(45.0, 75.0, 20)), Axis("b_over_a", [2.0, 3.0])],
        measure=CriticalStep(),
    )
    shown = study._repr_html_()
    assert "Angles &lt; 90 (40 cells)" in shown
    table_of = {row[0]: row for row in rows(shown)}
    assert table_of["phi"][2] == "45, 46.5789, 48.1579, ..., 75 (20)"
    assert table_of["phi"][3] == "degree"
    assert table_of["b_over_a"][2] == "2, 3 (2)"
    assert table_of["a"][2] == "0.011"
    assert table_of["critical_velocity_ratio"][2] == "V*"


def test_verdicts_show_what_moved_and_are_a_table_of_pandas():
    about = {"statement": "x < y", "source": "paper", "variable": "slope", "where": {}}
    numbers = {"published": 2.0, "tolerance": 0.1, "reason": "rounded"}
    claims = [
        Claim(id="C1", **about, **numbers),
        Claim(id="C2", **about, **numbers | {"published": 3.0}),
    ]
    found = build_verdict_table(xr.Dataset({"slope": 2.05}), claims, {})
    shown = rows(found._repr_html_())
    assert shown[1] == ["C1", "x < y", "2", "2.05", "0.1: rounded", "reproduced"]
    assert shown[2][5] == "differs, expected reproduced"
    lines = repr(found).splitlines()
    assert [re.split(r"\s{2,}", line) for line in lines] == [
        ["id", "claim", "published", "computed", "tolerance", "verdict"],
        ["C1", "x < y", "2", "2.05", "0.1", "reproduced"],
        ["C2", "x < y", "3", "2.05", "0.1", "differs, unexpected"],
    ]
    long = found.assign(claim="longer than a line " * 9)
    assert max(map(len, repr(ClaimVerdictTable(long)).splitlines())) <= 100
    assert type(found[found.verdict_changed]) is pd.DataFrame
    assert found[found.verdict_changed]["id"].tolist() == ["C2"]


@pytest.mark.parametrize(
    ("formula", "written"),
    [
        ("$k/k_{cr}(V_*)$", "<i>k/k<sub>cr</sub>(V<sub>*</sub>)</i>"),
        (
            r"$\Delta\tau_s/\sigma_*$",
            "<i>Δτ<sub>s</sub>/\N{GREEK SMALL LETTER SIGMA}<sub>*</sub></i>",
        ),
        (r"$\log_{10}(V/V_*)$", "<i>log<sub>10</sub>(V/V<sub>*</sub>)</i>"),
        (r"$V(0^+)\,\nonsense{x}$", "<i>V(0<sup>+</sup>)x</i>"),
        ("a<b", "a&lt;b"),
    ],
)
def test_symbols_need_no_mathjax(formula, written):
    assert format_symbol_as_html(formula) == written


def test_texts_of_strangers_stay_texts():
    assert "<script>" not in HtmlText.format_table(["<script>"], [["<script>"]], "<script>")


def test_the_accessor_shows_numbers_and_verdicts():
    """Results are shown with verdicts, and motions with their events.

    Claims that are not applicable are summarised in one line.
    """
    declared = study_loader.load_study("linear_stability")
    few = run(declared.with_(b_over_a=2.0, phi=[40]), rtol=1e-3).rsf._repr_html_()
    assert "11 claims not checked: no published values for overrides or other units" in few
    done = run(declared, rtol=1e-3)
    shown = rows(done.rsf._repr_html_())
    assert ["id", "claim", "published", "computed", "tolerance and reason", "verdict"] in shown
    values = {
        f"{value:.8g}"
        for value in done[study_reconstruction.find_primary_output_name(done)].values.flat
    }
    assert len([row for row in shown if values & set(row)]) > 10
    scene = Scene(load_velocity_ratio=2.0, normal_stress="constant")
    motion = rsfstudy.simulate(scene, duration=0.1)
    shown = motion.rsf._repr_html_()
    for words in ("load_velocity_ratio = 2", "peak friction", "no event faster than 20 V_*"):
        assert words in shown
    for part in (motion.isel(time=0), motion.isel(time=slice(0)), motion[["slip"]]):
        assert "load_velocity_ratio = 2" in part.rsf._repr_html_()


# ---- numbers of a file ---------------------------------------------------------------------------


@pytest.fixture(scope="module")
def map_of_stiffness():
    study = study_of(
        "stiffness",
        LinearStability(),
        Axis("law", ["slip", "slowness"]),
        Axis("b_over_a", np.linspace(1.5, 6.0, 101)),
    )
    return run(study)


def told_of(dataset, tmp_path, monkeypatch) -> str:
    monkeypatch.setenv("COLUMNS", "120")
    dataset_files.write_dataset(dataset, tmp_path / "it.nc")
    return call_main("show", tmp_path / "it.nc").stdout


@pytest.mark.parametrize("value", [36.815156940184394, -77608.42471489437, 3.152948907494519e-9])
@pytest.mark.parametrize("share", [3.1e-2, 9.9e-7, 1e-11])
def test_numbers_have_the_digits_that_their_errors_leave(value, share):
    """The rounding error is at most a twentieth of the error estimate.

    The number of digits is the smallest number for which this holds.
    """
    error = share * abs(value)
    text = format_rounded_to_error(value, error)
    assert abs(float(text) - value) <= 0.05 * error
    digits = len(re.sub(r"e.*|^[-0.]+|\.", "", text))
    assert digits <= math.ceil(-math.log10(share)) + 2


def test_an_answer_for_one_scene_has_units_and_words(tmp_path):
    scales = {"slip_distance": "10 um", "reference_velocity": "1 um/s", "period": "10 ms"}
    rig = rsfstudy.Rig(normal_stress="100 MPa", stiffness="0.03 MPa/um", **scales)
    scene = rig.scene(law="slowness", a=0.01, b_over_a=1.4, load_velocity_ratio=10)
    cycle = rsfstudy.limit_cycle(scene, rtol=1e-4, engine="compiled")
    cycle = rig.in_units(cycle, stress="MPa", length="um")
    shown = {row["number"]: row["value"] for row in build_single_scene_result_table(cycle).rows}
    interval, units = shown["recurrence_interval"].split()
    left_out = abs(float(interval) - float(cycle.recurrence_interval))
    assert left_out <= 0.05 * float(cycle.recurrence_interval_error)
    assert units == "s"
    assert shown["slip_mode"] == "stick_slip"
    assert shown["max_slip_rate"].endswith(" um/s")
    assert "recurrence_interval_error" not in shown
    cycle.to_netcdf(tmp_path / "cycle.nc")
    assert (
        "Limit cycle of a spring-slider, slowness law"
        in call_main("show", tmp_path / "cycle.nc").stdout
    )


def test_a_motion_by_a_law_that_is_not_known_is_shown(tmp_path):
    """Stability and events are shown if a study file defines the law."""
    motion = rsfstudy.simulate(Scene(load_velocity_ratio=2.0), duration=0.1)
    scene = motion.attrs["scene"].replace('"law": "slip"', '"law": "of_a_stranger"')
    motion.assign_attrs(scene=scene).to_netcdf(tmp_path / "motion.nc")
    text = (Path(__file__).parent / "extensions" / "steep_law.py").read_text()
    (tmp_path / "study.py").write_text(text.replace('"steep"', '"of_a_stranger"'))
    for study, told in (
        ([], "stability and events are unavailable: law = 'of_a_stranger'"),
        (["--study", tmp_path / "study.py"], "no event faster than 20 V_*"),
    ):
        shown = call_main("show", tmp_path / "motion.nc", *study)
        assert shown.returncode == 0, shown.stderr
        assert told in " ".join(shown.stdout.split())
        assert "law = of_a_stranger" in shown.stdout


def test_a_table_of_samples_tells_what_was_drawn(tmp_path, monkeypatch):
    axis = Axis.samples({"b_over_a": uniform(1.3, 0.4)}, 4)
    drawn = run(study_of("drawn", LinearStability(), axis, Axis("law", ["slip", "slowness"])))
    shown = told_of(drawn, tmp_path, monkeypatch)
    for sample, ratio in enumerate(drawn.b_over_a.values):
        assert re.search(rf"^ +{sample} +slip +{ratio:.6g} ", shown, re.M)


def test_a_large_lattice_is_thinned(map_of_stiffness, tmp_path, monkeypatch):
    said = told_of(map_of_stiffness, tmp_path, monkeypatch)
    caption = "in sigma_*/D_c (24 of 202 cells, "
    assert (
        f"{caption}12 of 101 b_over_a, from first to last; to write all cells, use rsfstudy "
        "export --csv)" in " ".join(said.split())
    )
    lines = [line.split() for line in said.splitlines()]
    laws = ("slip", "slowness")
    rows = [line for line in lines if len(line) > 2 and line[0] in laws and line[1][0].isdigit()]
    assert len(rows) == 24
    assert [rows[0][1], rows[11][1]] == ["1.5", "6"]  # both ends
    for law, ratio, value, *_error in rows:
        near = map_of_stiffness.sel(law=law).sel(b_over_a=float(ratio), method="nearest")
        assert float(value) == pytest.approx(float(near.critical_stiffness), rel=1e-7)


def test_a_small_one_is_whole_and_names_how_cells_ended(map_of_stiffness, tmp_path, monkeypatch):
    for most in (18, 2):
        few = map_of_stiffness.isel(b_over_a=slice(0, 51, 50 // (most - 1))).copy(deep=True)
        assert "cells)" not in told_of(few, tmp_path, monkeypatch)
    few["status"][0, 1], few["critical_stiffness"][0, 1] = int(Status.NO_STEADY_STATE), np.nan
    rows = [line.split() for line in told_of(few, tmp_path, monkeypatch).splitlines()]
    (row,) = [row for row in rows if row[:2] == ["slip", "3.75"]]
    assert (row[2], row[-1]) == ("-", "no_steady_state")


def test_indices_that_are_refused_say_why(tmp_path, monkeypatch):
    """The reason for missing indices is shown with the numbers.

    A warning of the run contains the reason too. Some samples are softer than critical, so
    any step triggers instability.
    """
    uncertain = {"b_over_a": norm(2.0, 0.1), "stiffness_ratio": uniform(0.9, 0.2)}
    axis = Axis.samples(uncertain, 2, seed=1, method="saltelli")
    indices = SobolIndices("explained", "critical_velocity_ratio")
    study = study_of("refused", CriticalStep(), axis, reductions=[indices])
    with pytest.warns(
        IncompleteWarning, match="^no explained: . of 8 cells have no value, but the indices"
    ):
        done = run(study, rtol=1e-4)
    why = "[1-7] of 8 cells have no value, but the indices require all cells. Use narrower"
    said = " ".join(told_of(done, tmp_path, monkeypatch).split())
    assert re.search(f"no explained: {why}", said)
    assert re.search(f"no explained: {why}", done.rsf._repr_html_())


def test_notes_and_shares_of_small_samples_are_shown(tmp_path, monkeypatch):
    """The table lists only statuses that occur, and the indices of 4 samples have a note."""
    uncertain = {"b_over_a": norm(2.0, 0.1), "a": uniform(0.01, 0.005)}
    axis = Axis.samples(uncertain, 4, seed=1, method="saltelli")
    kinds = [
        SobolIndices("explained", "critical_stiffness"),
        StatusShares("ends", "critical_stiffness"),
    ]
    done = run(study_of("small", LinearStability(), axis, reductions=kinds))
    assert done.sizes["ended"] > 20
    said = " ".join(told_of(done, tmp_path, monkeypatch).split())
    assert "explained: the Sobol indices are not accurate, because" in said
    assert "without statuses whose share is 0" in said
    assert "worker_lost" not in said
    table = next(t for t in reduction_tables.build_reduction_tables(done) if "ends" in t.rows[0])
    assert len(table.rows) == 1
    assert len(table.unformatted_rows) == done.sizes["ended"]


@pytest.mark.parametrize("sizes", [{"x": 5}, {"x": 3, "y": 28}, {"x": 9, "y": 9, "z": 2, "u": 7}])
def test_a_sample_has_both_ends_and_so_many_cells_at_most(sizes):
    at = lattice_tables.select_thinned_points(sizes, 24)
    assert math.prod(map(len, at.values())) <= 24
    for name, size in sizes.items():
        assert at[name][0] == 0
        assert len(at[name]) == 1 or at[name][-1] == size - 1
    assert len(lattice_tables.select_thinned_points({"x": 5}, 24)["x"]) == 5


def test_an_error_estimate_above_the_tolerance_of_a_claim_is_reported():
    """The table contains a note, and the verdict is unchanged."""
    about = {"variable": "zeta", "where": {}, "published": 2.0, "reason": "an example"}
    claims = [
        Claim(id=f"C{n}", statement="zeta is 2", source="eq. 1", tolerance=tolerance, **about)
        for n, tolerance in enumerate((1e-4, 1e-2))
    ]
    dataset = xr.Dataset({"zeta": 1.9997, "zeta_error": 7.7e-4})
    table = build_verdict_table(dataset, claims, {})
    assert table["verdict"].tolist() == ["differs", "reproduced"]
    assert "error estimate 0.00077 exceeds the tolerance 0.0001" in table["note"][0]
    assert table["note"][1] == ""
    assert "exceeds the tolerance" in table._repr_html_()
    precise = build_verdict_table(dataset.assign(zeta_error=1e-9), claims, {})
    assert "note" not in precise


def test_redirected_output_has_lines_of_100_characters(monkeypatch):
    """The environment variable ``COLUMNS`` takes precedence."""
    monkeypatch.delenv("COLUMNS", raising=False)
    redirected = LiteralTextConsole(file=io.StringIO(), markup=False)
    assert redirected.width == 100
    monkeypatch.setenv("COLUMNS", "60")
    assert LiteralTextConsole(file=io.StringIO(), markup=False).width == 60
