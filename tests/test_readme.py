"""The README tells the truth: its Python runs as it stands, its commands exist, its numbers are
ours.
"""

import functools
import re
import shutil
from pathlib import Path

import pytest
from running import call, named_results

import rsfstudy
from rsfstudy.cli import cli

README = (Path(__file__).parent.parent / "README.md").read_text()
BLOCKS = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
#: The block that is a file of its own, run by its path.
FILE = next(i for i, block in enumerate(BLOCKS) if "study = Study(" in block)


def test_the_study_of_your_own_fits_in_thirty_lines():
    assert "<!-- file angle.py -->\n```python\n" + BLOCKS[FILE] in README
    assert len(BLOCKS[FILE].splitlines()) <= 30


def test_there_are_examples():
    assert len(BLOCKS) >= 4


@pytest.mark.parametrize("number", range(len(BLOCKS)))
def test_python_runs_as_it_stands(number, tmp_path, tmp_path_factory, cluster, monkeypatch):
    """In an empty directory, on workers that are there already; where it uses the results of a
    study, on those.
    """
    monkeypatch.chdir(tmp_path)
    code = BLOCKS[number]
    if number == FILE:
        (tmp_path / "angle.py").write_text(code)
        ran = call("run", "angle.py", "--serial")
        assert ran.returncode == 0, ran.stdout + ran.stderr
        return
    if "outputs/rate_step_boundary.nc" in code:
        _dataset, file = named_results("rate_step_boundary", tmp_path_factory)
        (tmp_path / "outputs").mkdir()
        shutil.copy(file, tmp_path / "outputs")
    monkeypatch.setattr(rsfstudy, "run", functools.partial(rsfstudy.run, client=cluster))
    names = {"__name__": "block"}
    exec(compile(code, f"block {number}", "exec"), names)
    for name, test in list(names.items()):
        if name.startswith("test_"):
            test()


def test_commands_and_options_exist():
    for command in re.findall(r"^rsfstudy (\w+)", README, re.MULTILINE):
        assert command in cli.commands
    options = {
        option for command in cli.commands.values() for o in command.params for option in o.opts
    }
    for option in re.findall(r"`(--[a-z-]+)", README):
        assert option in options


def test_the_table_of_promises_names_tests_that_exist():
    """And none of the tests of running, files and faults is left out."""
    table = README[README.index("| promise | tests |") : README.index("### Scale")]
    named = set(re.findall(r"`(test_\w+\.py)`", table))
    here = Path(__file__).parent
    assert all((here / name).is_file() for name in named)
    about = ("runner", "resume", "faults", "clusters", "scale", "files", "bad_input", "study")
    assert {f"test_{name}.py" for name in about} <= named


def test_every_study_is_listed():
    for name in rsfstudy.studies():
        assert f"| `{name}` |" in README


def test_the_table_of_zeta_is_ours(tmp_path_factory):
    dataset, _path = named_results("rate_step_boundary", tmp_path_factory)
    rows = re.findall(
        r"^\| (constant normal stress|alpha = [\d.]+) \| ([\d.]+) \| ([\d.]+) \|", README, re.M
    )
    assert len(rows) == dataset.sizes["case"]
    for case, zeta, error in rows:
        row = dataset.sel(case=case)
        digits = len(zeta.split(".")[1])
        assert float(row.zeta) == pytest.approx(float(zeta), abs=0.51 * 10.0**-digits)
        digits = len(error.split(".")[1])
        assert float(row.zeta_stderr) == pytest.approx(float(error), abs=0.51 * 10.0**-digits)


def test_the_tree_names_every_room_and_no_other():
    root, tree = Path(rsfstudy.__file__).parent, README[README.index("```\nstudies/") :]
    for folder, indent in ((root, "  "), (root / "slider", "    ")):
        lines = re.findall(rf"^{indent}((?:[a-z_]+/? +)*[a-z_]+/?) {{2,}}", tree, re.MULTILINE)
        named = {room.strip("/") for line in lines for room in line.split()}
        files = {
            p.stem for p in folder.iterdir() if p.suffix == ".py" or (p / "__init__.py").exists()
        }
        assert named == files - {"__init__"}
