"""Tests of the JSON output of commands.

The numbers equal the numbers of the datasets, the keys are documented, and the exit status is the
same as without ``--json``.
"""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from faulty_study import faulty_study
from site_pages import PAGES, find_page
from study_runs import call_main, run_with_failures

import rsfstudy
from rsfstudy import Scene
from rsfstudy.cli import command_results, commands, study_results
from rsfstudy.cli.command_group import CommandGroup
from rsfstudy.cli.command_line import cli
from rsfstudy.referee.benchmark_problem_files import find_shipped_problem_files
from rsfstudy.storage import dataset_files

TEXT = (PAGES / "reference" / "json.md").read_text()
#: Study whose critical stiffness is proportional to b - a.
STUDY_FILE = """
from rsfstudy import Axis, Claim, Scene, Study
from rsfstudy.measures import LinearStability
from rsfstudy.reductions import LinearFit

about = {"statement": "slope", "source": "theory", "variable": "slope", "where": {}}
study = Study(
    name="slopes",
    title="Critical stiffness against b/a",
    base=Scene(normal_stress="constant", a=0.01),
    axes=[Axis("law", ["slip", "slowness"]), Axis("b_over_a", [1.5, 2.0, 3.0])],
    measure=LinearStability(),
    reductions=[LinearFit(name="slope", of="critical_stiffness", on="b_over_a")],
    claims=[
        Claim(
            id="C1", **about | {"where": {"law": "slip"}}, published=0.01, tolerance=1e-6,
            reason="k_cr = (b - a)",
        )
    ],
)
"""


def output_of(*words: Any) -> tuple[dict[str, Any], int]:
    """Return the JSON output of a command and its exit status.

    The exit status in the output is the exit status of the command, and the output consists of
    finite numbers.
    """
    ran = call_main(*words, "--json")
    found = json.loads(ran.stdout, parse_constant=pytest.fail)
    status = ran.returncode or 0
    assert (found["command"], found["format"]) == (words[0], 1)
    assert found["exit_status"] == status
    return found, status


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    """Return a directory with results of a study and of the same study with other points."""
    folder = tmp_path_factory.mktemp("json")
    (folder / "slopes.py").write_text(STUDY_FILE)
    for output, settings in (("out", ()), ("other", ("--set", "b_over_a=2,3,4"))):
        words = ("--serial", "--quiet", "--output", folder / output, *settings)
        assert call_main("run", folder / "slopes.py", *words).returncode == 0
    return folder


# ---- keys ----------------------------------------------------------------------------------------
def documented_keys(heading: str) -> dict[str, str]:
    """Return the meanings of the keys in the table below a heading of the page."""
    section = TEXT.split(f"## {heading}\n")[1].split("\n## ")[0]
    found = {}
    for line in re.findall(r"^\| (.*) \|$", section, re.MULTILINE)[1:]:
        names, *_others, meaning = line.split(" | ")
        for name in re.findall(r"`([^`]+)`", names):
            found[name] = meaning
        for anchor in re.findall(r"^all keys of .*\(#([a-z-]+)\)", names):
            found |= keys_of_anchor(anchor)
    for name, meaning in list(found.items()):
        for anchor in re.findall(r"with the keys of the table .*\(#([a-z-]+)\)", meaning):
            found |= {f"{name}.{key}": text for key, text in keys_of_anchor(anchor).items()}
            del found[name]
    return found


def keys_of_anchor(anchor: str) -> dict[str, str]:
    return documented_keys(anchor.replace("-", " ").capitalize())


def used_keys(value: Any, documented: dict[str, str], path: str = "") -> Iterator[str]:
    """Yield the paths of the values of an object, down to documented objects."""
    if documented.get(path, "").startswith(("object", "any value")) or path.endswith(".versions"):
        yield path
    elif isinstance(value, dict):
        for name, part in value.items():
            yield from used_keys(part, documented, f"{path}.{name}" if path else name)
    elif isinstance(value, list):
        for part in value:
            yield from used_keys(part, documented, f"{path}[]")
        if not value:
            yield f"{path}[]"
    else:
        yield path


def assert_documented(found: dict[str, Any]) -> None:
    """Assert that an output has only documented keys."""
    documented = documented_keys(f"rsfstudy {found['command']} --json")
    used = set(used_keys(found, documented)) - {"command", "format", "exit_status"}
    # An empty list has no keys.
    parents = {".".join(key.split(".")[:n]) for key in documented for n in range(1, 4)}
    assert used <= {*documented, *parents}


def test_every_command_with_json_has_a_table():
    headings = re.findall(r"^## rsfstudy (\w+) --json$", TEXT, re.MULTILINE)
    with_json = [n for n, c in cli.commands.items() if "as_json" in {p.name for p in c.params}]
    assert sorted(headings) == sorted(with_json)
    assert {"list", "show", "run", "check", "compare", "fit", "verify"} <= set(with_json)


# ---- commands ------------------------------------------------------------------------------------
def test_list():
    found, status = output_of("list")
    assert_documented(found)
    assert status == 0
    expected = [{"name": n, "title": s.title} for n, s in rsfstudy.studies().items()]
    assert found["studies"] == expected


def test_show_a_study():
    found, status = output_of("show", "rate_step_boundary", "--set", "b_over_a=2,3")
    assert_documented(found)
    assert status == 0
    assert (found["kind"], found["study"], found["cells"]) == ("study", "rate_step_boundary", 6)
    axis = next(axis for axis in found["axes"] if axis["dimension"] == "b_over_a")
    assert (axis["size"], axis["values"]) == (2, [2.0, 3.0])
    assert found["measure"]["name"] == "critical_step"
    assert found["scene"]["a"] == 0.0145
    assert "b_over_a" not in found["scene"]
    assert {"name": "critical_velocity_ratio", "has_error": True} in found["outputs"]
    assert found["cost"]["measured_cells"] == 0
    assert found["cost"]["seconds"] > 0.0


def test_quantities_of_a_rig_that_vary_are_not_listed(tmp_path):
    words = ["slide_hold_slide", "--set", "hold_time=10", "--normal-stress", "5 MPa"]
    words += ["--slip-distance", "10 um", "--reference-velocity", "1 um/s"]
    assert output_of("show", *words)[0]["rig"] == {
        "normal_stress": 5e6,
        "slip_distance": pytest.approx(1e-5),
        "reference_velocity": pytest.approx(1e-6),
    }
    study = rsfstudy.studies()["rig_recurrence"]
    varied = {field for axis in study.axes for field in axis.fields}
    found = output_of("show", "rig_recurrence")[0]
    assert varied == {"law", "sigma_star", "load_velocity"}
    assert "normal_stress" not in found["rig"]  # sigma_star is the axis of the normal stress
    assert "slip_distance" in found["rig"]
    assert not varied & set(found["scene"])


def test_show_results_and_their_reductions(place):
    file = place / "out" / "slopes.nc"
    found, status = output_of("show", file)
    assert_documented(found)
    assert (status, found["kind"]) == (0, "results")
    dataset = rsfstudy.open(file)
    assert found["lattice"] == {"law": 2, "b_over_a": 3}
    assert found["statuses"] == {"ok": 6}
    assert found["rhs_evaluations"] == int(dataset.rhs_evaluations.sum())
    for row in found["reductions"]:
        assert row["name"] == "slope"
        one = dataset.sel(row["coordinates"])
        assert row["value"] == one.slope.item()
        for part in ("stderr", "misfit", "points", "error"):
            assert row[part] == one[f"slope_{part}"].item(), part
    assert len(found["reductions"]) == 2
    assert found["reductions"][0]["value"] == pytest.approx(0.01, rel=1e-9)
    for row in found["primary_output"]:
        one = dataset.sel(row["coordinates"])
        assert (row["name"], row["value"]) == ("critical_stiffness", one.critical_stiffness.item())
    assert len(found["primary_output"]) == 6
    assert found["provenance"]["versions"]["rsfstudy"] == version("rsfstudy")


def test_check(place):
    found, status = output_of("check", place / "out" / "slopes.nc")
    assert_documented(found)
    verdicts = rsfstudy.check(place / "out" / "slopes.nc")
    assert status == 0
    (claim,) = found["claims"]
    (row,) = verdicts.to_dict("records")
    former = {"ours": "computed", "moved": "verdict_changed", "because": "difference_reason"}
    assert claim == {"study": "slopes"} | row | {old: row[new] for old, new in former.items()}
    assert claim["verdict"] == "reproduced"
    (study,) = found["studies"]
    assert [one["value"] for one in study["reductions"]] == pytest.approx([0.01, 0.01], rel=1e-9)


def test_check_of_a_changed_verdict_and_of_a_claim_that_does_not_apply(place, tmp_path):
    changed = rsfstudy.open(place / "out" / "slopes.nc").load()
    changed["slope"] = changed["slope"] + 0.5
    dataset_files.write_dataset(changed, tmp_path / "changed.nc")
    found, status = output_of("check", tmp_path / "changed.nc")
    assert status == 1
    assert [one["verdict_changed"] for one in found["claims"]] == [True]
    changed["slope"] = changed["slope"] * np.nan
    dataset_files.write_dataset(changed, tmp_path / "missing.nc")
    found, status = output_of("check", tmp_path / "missing.nc")
    assert (status, found["claims"][0]["computed"]) == (1, None)
    assert found["claims"][0]["verdict"] == "undecided"
    # A slope through fewer points than declared does not belong to the claim.
    checked, status = output_of("check", place / "other" / "slopes.nc")
    assert (status, checked["unapplied_claims"]) == (1, ["C1"])


def test_check_of_all_studies(place, tmp_path):
    found, status = output_of("check", "--all", "--output", tmp_path)
    assert_documented(found)
    assert status == 1
    assert {*found["not_run"], *found["skipped"]} == set(rsfstudy.studies())
    files = [str(place / folder / "slopes.nc") for folder in ("out", "other")]
    several = [study_results.StudyResults(rsfstudy.open(file), file) for file in files]
    verdicts = study_results.collect_verdicts(several)
    claims = study_results.convert_verdicts_to_json(verdicts)
    assert [claim["study"] for claim in claims] == ["slopes", "slopes"]
    assert [claim["verdict"] for claim in claims] == ["reproduced", "not applicable"]
    assert set(claims[0]) == set(documented_keys("Verdict on a claim"))


def test_run_prints_nothing_else_on_the_standard_output(place, tmp_path):
    found, status = output_of("run", place / "slopes.py", "--serial", "--output", tmp_path)
    assert_documented(found)
    assert status == 0
    (study,) = found["studies"]
    assert (study["study"], study["outcome"], study["problems"]) == ("slopes", "ok", [])
    assert study["files"] == [str(tmp_path / f"slopes.{suffix}") for suffix in ("nc", "png")]
    dataset = rsfstudy.open(tmp_path / "slopes.nc")
    values = [row["value"] for row in study["results"]["reductions"]]
    assert values == dataset.slope.values.tolist()
    assert [claim["verdict"] for claim in study["claims"]] == ["reproduced"]


def test_failed_cells(tmp_path):
    study = faulty_study("raises", at=(2.5,))
    run_with_failures(study, output=tmp_path)
    found, status = output_of("show", tmp_path / "faulty.nc")
    assert_documented(found)
    assert status == 1
    (cell,) = found["failed_cells"]
    assert (cell["coordinates"]["b_over_a"], cell["status"]) == (2.5, "cell_raised")
    assert cell["command"].startswith("rsfstudy rerun ")
    values = {row["coordinates"]["b_over_a"]: row for row in found["primary_output"]}
    assert (values[2.5]["value"], values[2.5]["status"]) == (None, "cell_raised")
    assert found["statuses"]["cell_raised"] == 1
    checked, status = output_of("check", tmp_path / "faulty.nc")
    assert status == 1
    assert checked["studies"][0]["failed_cells"] == found["failed_cells"]


def test_compare(place):
    files = [place / folder / "slopes.nc" for folder in ("out", "other")]
    found, status = output_of("compare", *files)
    assert_documented(found)
    datasets = [rsfstudy.open(file) for file in files]
    agreement = rsfstudy.compare(*datasets)
    assert status == (0 if agreement.agrees else 1)
    assert found["agrees"] is agreement.agrees
    assert found["cells"] == {"both": 4, "first_only": 2, "second_only": 2}
    (axis,) = found["axes"]
    assert axis == {"dimension": "b_over_a", "first_only": [1.5], "second_only": [4.0]}
    rows = agreement.agreement_table.to_dict("records")
    for ours, row in zip(found["variables"], rows, strict=True):
        expected = row["largest_difference"]
        assert ours["largest_difference"] == (None if math.isnan(expected) else expected)
        assert ours["identical"] == row["identical"]
    assert found["uncompared_variables"] == dict(agreement.uncompared_variables)


def test_compare_of_other_statuses(place, tmp_path):
    changed = rsfstudy.open(place / "out" / "slopes.nc").load()
    changed["status"][0, 1] = 4
    dataset_files.write_dataset(changed, tmp_path / "changed.nc")
    found, status = output_of("compare", place / "out" / "slopes.nc", tmp_path / "changed.nc")
    assert_documented(found)
    assert status == 1
    (cell,) = found["statuses"]
    assert cell["coordinates"] == {"law": "slip", "b_over_a": 2.0}
    assert cell["first"] == "ok"
    assert cell["second"] == rsfstudy.measures.Status(4).label


def test_events(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    time = np.arange(2000.0)
    noise = np.random.default_rng(0).normal(scale=0.01, size=2000)
    table = np.column_stack([time, 5.0 + 0.002 * (time % 500.0) + noise])
    np.savetxt("run.csv", table, delimiter=",", header="Time (s),Shear stress (MPa)")
    found, status = output_of("events", "run.csv")
    assert_documented(found)
    assert status == 0
    drops = [event["static_stress_drop"] for event in found["records"][0]["events"]]
    assert drops == rsfstudy.events("run.csv")["static_stress_drop"].values.tolist()


def test_fit_and_its_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(PAGES / "step.csv", tmp_path)
    words = ["--normal-stress", "20 MPa", "--stiffness", "0.04 MPa/um", "--step", "1"]
    words += ["--after", "40 um", "--law", "slowness", "--free", "a,b", "--noise", "white"]
    found, status = output_of("fit", "step.csv", *words)
    assert_documented(found)
    one = dataset_files.read_dataset(Path("fit.nc")).squeeze()
    (fit,) = found["fits"]
    assert fit["status"] in ("ok", "not_identified", "errors_not_valid")
    assert status == (0 if fit["status"] != "errors_not_valid" else 1)
    for parameter in fit["parameters"]:
        assert parameter["value"] == one[parameter["name"]].item()
        assert parameter["stderr"] == one[f"{parameter['name']}_stderr"].item()
    assert {parameter["name"] for parameter in fit["parameters"]} == {"a", "b", "a_minus_b"}
    assert (fit["aic"], fit["n_eff"]) == (one.aic.item(), one.n_eff.item())
    record = rsfstudy.read_record("step.csv", normal_stress="20 MPa")
    assert found["records"][0]["rows"] == len(record)
    steps = [step["velocity_after"] for step in found["records"][0]["steps"]]
    assert steps == [step.velocity_after for step in record.loading_steps]
    shown, again = output_of("show", "fit.nc")
    assert_documented(shown)
    assert (again, shown["kind"], shown["fits"]) == (status, "fit", found["fits"])


def test_healing_and_its_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(PAGES / "holds.csv", tmp_path)
    found, status = output_of("healing", "holds.csv")
    assert_documented(found)
    table = xr.load_dataset("healing.nc")
    assert (status, found["record"], len(found["holds"])) == (0, "holds", 5)
    for number, hold in enumerate(found["holds"]):
        assert hold["healing"] == table["healing"][number].item()
        assert hold["healing_stderr"] == table["healing_stderr"][number].item()
    assert found["healing_rate"] == table["healing_rate"].item()
    # The exact slope and stiffness of the synthetic record.
    assert abs(found["healing_rate"] - 0.02551) < 2.0 * found["healing_rate_stderr"]
    assert abs(found["stiffness"] - 2.5e-3) < 2.0 * found["stiffness_stderr"]


def test_show_a_motion_and_a_critical_step(tmp_path):
    scene = Scene(law="slip", normal_stress="constant", stiffness_ratio=3.0, hold_time=2.0)
    motion = rsfstudy.simulate(scene, duration=5.0)
    motion.to_netcdf(tmp_path / "motion.nc")
    found, status = output_of("show", tmp_path / "motion.nc")
    assert_documented(found)
    assert (status, found["kind"], found["status"]) == (0, "motion", "ok")
    friction = motion.friction_coefficient
    assert found["motion"]["peak_friction"] == friction.max().item()
    assert found["motion"]["peak_friction_time"] == motion.time[int(friction.argmax("time"))].item()
    assert found["motion"]["peak_slip_rate"] == (10.0**motion.log10_slip_rate).max().item()
    assert found["motion"]["instability_time"] is None
    assert found["scene"]["hold_time"] == 2.0
    scene = Scene(law="slip", normal_stress="constant")
    step = rsfstudy.critical_step(scene, of="load_velocity_ratio", rtol=1e-4)
    step.to_netcdf(tmp_path / "step.nc")
    found, status = output_of("show", tmp_path / "step.nc")
    assert_documented(found)
    assert (status, found["kind"]) == (0, "scene")
    numbers = {row["name"]: row for row in found["values"]}
    row = numbers["critical_velocity_ratio"]
    assert row["value"] == step.critical_velocity_ratio.item()
    assert row["error"] == step.critical_velocity_ratio_error.item()


def test_verify(tmp_path):
    answer = find_shipped_problem_files()[19].with_suffix(".csv")
    found, status = output_of("verify", answer)
    assert_documented(found)
    assert status == 0
    (file,) = found["files"]
    assert (file["problem"], file["passed"], file["explanation"]) == (19, True, "")
    assert file["digits"] == min(one["digits"] for one in file["quantities"])
    heading, first, *others = answer.read_text().splitlines()
    numbers = first.split(",")
    numbers[-1] = f"{1.001 * float(numbers[-1]):.12g}"
    (tmp_path / "19.csv").write_text("\n".join([heading, ",".join(numbers), *others]) + "\n")
    found, status = output_of("verify", answer, tmp_path / "19.csv")
    assert status == 1
    assert [file["passed"] for file in found["files"]] == [True, False]
    assert 2.9 < found["files"][1]["digits"] <= 3.1


# ---- usage errors, values and the group of commands ----------------------------------------------
@pytest.mark.parametrize(
    "words", [["check"], ["show", "no_such_study"], ["run", "--all", "slopes"], ["compare", "a.nc"]]
)
def test_wrong_usage_prints_no_object(words):
    ran = call_main(*words, "--json")
    plain = call_main(*words)
    assert (ran.returncode, ran.stdout, ran.stderr) == (2, "", plain.stderr)


def test_values_without_a_json_form():
    given = {1: math.nan, "b": np.array([1.0, np.inf]), "c": np.int8(3), "d": Path("x/y"), "e": ()}
    expected = {"1": None, "b": [1.0, None], "c": 3, "d": str(Path("x/y")), "e": []}
    assert command_results.convert_to_json_value(given) == expected
    assert command_results.convert_to_json_value([True, None, np.bool_(False)]) == [
        True,
        None,
        False,
    ]


def test_the_example_of_the_page_runs(tmp_path):
    """The example of a CI job passes, and fails for another published value."""
    block = re.search(r"<!-- json example -->\n```sh\n(.*?)```", TEXT, re.DOTALL)[1]
    functions = (
        f'rsfstudy() {{ "{sys.executable}" -m rsfstudy.cli.command_line "$@"; }}\n'
        f'python() {{ "{sys.executable}" "$@"; }}\n'
    )
    job = ["bash", "-e", "-c", functions + block]
    ran = subprocess.run(job, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    assert re.fullmatch(r"zeta = 0\.66\d \+- 0\.00\d\n", ran.stdout)
    example = block.partition("python -c")
    wrong = functions + "".join(example[1:]).replace("0.664", "0.764")
    ran = subprocess.run(
        ["bash", "-e", "-c", wrong], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 1
    assert "AssertionError" in ran.stderr


def test_every_module_of_a_command_is_in_the_table():
    folder = Path(command_results.__file__).parent / "commands"
    modules = {file.stem for file in folder.glob("[!_]*.py")}
    assert set(commands.MODULE_BY_COMMAND.values()) == modules
    assert list(cli.commands) == list(commands.MODULE_BY_COMMAND)
    assert all(command.name == name for name, command in cli.commands.items())


def test_a_new_command_is_one_module_and_one_line(place, tmp_path, monkeypatch):
    """The command in the page on extensions counts cells."""
    text = find_page("<!-- file count.py -->")
    code = re.search(r"<!-- file count.py -->\n```python\n(.*?)```", text, re.DOTALL)[1]
    (tmp_path / "count.py").write_text(code)
    monkeypatch.setattr(commands, "__path__", [*commands.__path__, str(tmp_path)])
    monkeypatch.setitem(commands.MODULE_BY_COMMAND, "count", "count")
    monkeypatch.setattr(cli, "commands", CommandGroup(name="rsfstudy").commands)
    assert "Count the cells of FILE" in call_main("--help").stdout
    assert call_main("count", place / "out" / "slopes.nc").stdout == "6 of 6 cells are ok\n"
    found, status = output_of("count", place / "out" / "slopes.nc")
    assert (status, found["ok"], found["cells"]) == (0, 6, 6)
    sys.modules.pop("rsfstudy.cli.commands.count")
