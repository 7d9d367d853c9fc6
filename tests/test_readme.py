"""Tests of the README and the documentation pages.

The Python examples run without changes, the commands exist, and the printed numbers agree
with computed values.
"""

import ast
import functools
import inspect
import re
import shlex
import shutil
from pathlib import Path

import pytest
from study_runs import call_main, named_results

import rsfstudy
from rsfstudy import measures, reductions
from rsfstudy.cli.command_line import cli
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.slider import laws
from rsfstudy.slider.parts import field_names

ROOT = Path(__file__).parent.parent
#: The README, and the pages to which it links.
FILES = [ROOT / "README.md", *sorted((ROOT / "studies" / "pages").glob("*.md"))]
TEXT = "\n".join(file.read_text() for file in FILES)
BLOCKS = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
#: Index of the code block that is a study file.
FILE = next(i for i, block in enumerate(BLOCKS) if "study = Study(" in block)


def test_the_readme_is_read_in_a_few_minutes():
    """The README has at most 150 lines, and sentences of at most 25 words.

    Code, tables and links are excluded.
    """
    text = FILES[0].read_text()
    assert len(text.splitlines()) <= 150
    prose = re.sub(r"(?ms)^```.*?^```$|^\|.*?$|^#.*?$|<!--.*?-->", "\n\n", text)
    prose = re.sub(r"\]\([^)]*\)", "]", prose)
    said = re.split(r"(?<=[.?:])\*{0,2}\s+(?=[A-Z`])|\n\n|^- ", prose, flags=re.MULTILINE)
    assert [sentence for sentence in said if len(sentence.split()) > 25] == []


def test_the_readme_leads_to_each_of_its_pages():
    """The README links to each page.

    The tests of the site check that links have valid targets.
    """
    named = re.findall(r"\]\((studies/pages/[^)#]+)", FILES[0].read_text())
    assert {ROOT / name for name in named} == set(FILES[1:])


def test_the_study_of_your_own_fits_in_thirty_lines():
    assert "<!-- file angle.py -->\n```python\n" + BLOCKS[FILE] in TEXT
    assert len(BLOCKS[FILE].splitlines()) <= 30


def test_there_are_examples():
    assert len(BLOCKS) >= 4


def lay_record(folder: Path) -> None:
    """Copy the record of the examples to the places where they read it."""
    pages = folder / "studies" / "pages"
    pages.mkdir(parents=True)
    for place in (folder, pages):
        for name in ("step.csv", "holds.csv"):
            shutil.copy(ROOT / "studies" / "pages" / name, place)


@pytest.mark.parametrize("number", range(len(BLOCKS)))
def test_python_runs_as_it_stands(number, tmp_path, tmp_path_factory, cluster, monkeypatch):
    """Each example runs in an empty directory.

    The examples share workers, and results of named studies are copied.
    """
    monkeypatch.chdir(tmp_path)
    code = BLOCKS[number]
    if number == FILE:
        (tmp_path / "angle.py").write_text(code)
        ran = call_main("run", "angle.py", "--serial")
        assert ran.returncode == 0, ran.stdout + ran.stderr
        return
    if "outputs/rate_step_boundary.nc" in code:
        _dataset, file = named_results("rate_step_boundary", tmp_path_factory)
        (tmp_path / "outputs").mkdir()
        shutil.copy(file, tmp_path / "outputs")
    if "step.csv" in code or "holds.csv" in code:
        lay_record(tmp_path)
    monkeypatch.setattr(rsfstudy, "run", functools.partial(rsfstudy.run, client=cluster))
    names = {"__name__": "block"}
    exec(compile(code, f"block {number}", "exec"), names)
    for name, test in list(names.items()):
        if name.startswith("test_"):
            test()


PRINTS = re.findall(r"```python\n([^`]*)```\n\n```text\n(.*?)```", FILES[0].read_text(), re.DOTALL)


@pytest.mark.parametrize(("code", "told"), PRINTS, ids=["cycle", "fit"])
def test_the_readme_prints_what_it_says(code, told, tmp_path, monkeypatch, capsys):
    """The printed digits are correct on any machine.

    The numbers are not close to a rounding boundary.
    """
    lay_record(tmp_path)
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    exec(compile(code, "README.md", "exec"), names)
    assert capsys.readouterr().out.split() == told.split()
    values = [names.get("interval"), names.get("drop")]
    if "table" in names:
        values = names["table"].select_dtypes(float).to_numpy().ravel().tolist()
    printed = re.findall(r"\d+\.\d+", told)
    for value, text in zip(values, printed, strict=True):
        assert_digits_hold(value, text)


#: Relative difference between processors with different orders of operations, which is up to
#: 6e-7 for fits.
BETWEEN_MACHINES = 5e-6


def assert_digits_hold(value: float, text: str, differs: float = BETWEEN_MACHINES) -> None:
    """Assert that a number and slightly different numbers round to a text."""
    half = 0.5 * 10.0 ** -len(text.split(".")[1])
    assert abs(value - float(text)) + differs * abs(value) <= half, (value, text)


@pytest.mark.parametrize("text", ["26.10512", "26.11"])
def test_digits_that_another_machine_may_round_otherwise_are_found(text):
    with pytest.raises(AssertionError):
        assert_digits_hold(26.105118, text)
    assert_digits_hold(26.105118, "26.1")


def test_the_command_of_the_readme_fits_the_record(tmp_path, monkeypatch):
    """The command equals the command of the page on fits.

    Only the path of the record differs. The output of that command is tested elsewhere.
    """
    texts = (FILES[0].read_text(), (ROOT / "studies" / "pages" / "fits.md").read_text())
    here, there = (re.search(r"^rsfstudy fit .*$", text, re.MULTILINE)[0] for text in texts)
    assert here == there.replace("step.csv", "studies/pages/step.csv")
    lay_record(tmp_path)
    monkeypatch.chdir(tmp_path)
    ran = call_main(*shlex.split(here)[1:])
    assert ran.returncode == 0, ran.stderr
    assert {"fit.png", "fit.nc"} <= {file.name for file in tmp_path.iterdir()}


@pytest.mark.parametrize(
    ("base", "example", "written"),
    [
        (laws.Law, laws.BUILT_IN_PARTS["slowness"], ("evolution", "parameter_values", "check")),
        (measures.Measure, CriticalStep, ("compute", "error_scales")),
        (reductions.Reduction, reductions.Reduction, ("__call__", "derivatives")),
    ],
)
def test_help_states_the_signatures_of_what_one_writes(base, example, written):
    for name in written:
        takes = ", ".join(inspect.signature(getattr(example, name)).parameters)
        assert f"    {name}({takes}) -> " in base.__doc__


def test_commands_and_options_exist():
    for command in re.findall(r"^rsfstudy (\w+)", TEXT, re.MULTILINE):
        assert command in cli.commands
    options = {
        option for command in cli.commands.values() for o in command.params for option in o.opts
    }
    for option in re.findall(r"`(--[a-z-]+)", TEXT):
        assert option in options


def test_the_table_of_promises_names_tests_that_exist():
    """The table names existing test modules, and no module is missing."""
    table = TEXT[TEXT.index("| promise | tests |") : TEXT.index("## Scale")]
    named = set(re.findall(r"`(test_\w+\.py)`", table))
    here = Path(__file__).parent
    assert all((here / name).is_file() for name in named)
    about = ("runner", "resume", "faults", "clusters", "scale", "files", "bad_input", "study")
    assert {f"test_{name}.py" for name in about} <= named


def test_every_study_is_listed():
    for name in rsfstudy.studies():
        assert f"| `{name}` |" in TEXT


def test_every_law_is_listed():
    for name, law in laws.BUILT_IN_PARTS.items():
        row = re.search(rf"^\| (?:`\w+`, )*`{name}`.*$", TEXT, re.MULTILINE)
        assert row, name
        own = set(field_names(law)) - set(field_names(laws.Law))
        assert all(f"`{field}`" in row[0] for field in own)
    assert all(f"`{field}`" in TEXT for field in field_names(laws.Law) if field != "b_over_a")


def test_the_table_of_zeta_is_ours(tmp_path_factory):
    dataset, _path = named_results("rate_step_boundary", tmp_path_factory)
    rows = re.findall(
        r"^\| (constant normal stress|alpha = [\d.]+) \| ([\d.]+) \| ([\d.]+) \|", TEXT, re.M
    )
    assert len(rows) == dataset.sizes["case"]
    for case, zeta, error in rows:
        row = dataset.sel(case=case)
        # Processors change the last digits of motions by less than the error estimate.
        assert_digits_hold(float(row.zeta), zeta, float(row.zeta_error))
        assert_digits_hold(float(row.zeta_stderr), error)


def lines_of_code(source: str, nodes: list[ast.stmt]) -> int:
    """Return the number of code lines of some statements.

    Blank lines, comments and docstrings are excluded.
    """
    lines = source.splitlines()
    first = [min(d.lineno for d in [*getattr(n, "decorator_list", ()), n]) for n in nodes]
    spans = [range(a, n.end_lineno + 1) for a, n in zip(first, nodes, strict=True)]
    kinds = ast.ClassDef, ast.FunctionDef
    bodies = [n.body for node in nodes for n in ast.walk(node) if isinstance(n, kinds)]
    inside = [part for body in bodies for part in body]
    texts = [n for n in inside if isinstance(n, ast.Expr) and isinstance(n.value, ast.Constant)]
    words = {n for text in texts for n in range(text.lineno, text.end_lineno + 1)}
    code = {n for span in spans for n in span} - words
    return sum(lines[n - 1].strip()[:1] not in ("", "#") for n in code)


def test_what_it_takes_to_add_something_is_counted():
    rows = re.findall(r"^\|.*`(\w+\.py)` \| (\d+) \| (\d+) \|$", TEXT, re.MULTILINE)
    examples = Path(__file__).parent / "extensions"
    assert {name for name, _part, _file in rows} == {file.name for file in examples.glob("*.py")}
    for name, *stated in rows:
        source = (examples / name).read_text()
        code = ast.parse(source).body[1:]
        beside = ast.Import, ast.ImportFrom
        part = [node for node in code if not isinstance(node, beside) and node is not code[-1]]
        assert [lines_of_code(source, nodes) for nodes in (part, code)] == [*map(int, stated)], name


def test_the_tree_names_every_room_and_no_other():
    root, tree = Path(rsfstudy.__file__).parent, TEXT.split("```\nstudies/")[1].split("```")[0]
    for folder, indent in ((root, "  "), (root / "slider", "    ")):
        lines = re.findall(rf"^{indent}((?:[a-z_]+/? +)*[a-z_]+/?) {{2,}}", tree, re.MULTILINE)
        named = {room.strip("/") for line in lines for room in line.split()}
        files = {
            p.stem for p in folder.iterdir() if p.suffix == ".py" or (p / "__init__.py").exists()
        }
        assert named == files - {"__init__"}
