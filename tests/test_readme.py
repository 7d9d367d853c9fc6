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
import xarray as xr
from site_pages import FILES, PAGES, ROOT, code_blocks, find_page
from study_runs import call_main, named_results

import rsfstudy
from rsfstudy import measures, reductions
from rsfstudy.cli.command_line import cli
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.slider import laws
from rsfstudy.slider.parts import list_part_field_names

TEXT = "\n".join(file.read_text() for file in FILES)
#: Tutorials, whose code blocks depend on the previous blocks of the page.
TUTORIALS = sorted(file for file in FILES if file.parent.name == "tutorials")
#: Python blocks of the other pages, each with the text that it prints, or an empty string.
BLOCKS = [
    block
    for file in FILES
    if file not in TUTORIALS
    for block in re.findall(
        r"```python\n(.*?)```(?:\n\n```text\n(.*?)```)?", file.read_text(), re.DOTALL
    )
]


def test_the_readme_is_read_in_a_few_minutes():
    """The README has at most 120 lines and one table, and sentences of at most 25 words.

    Code, tables and links are excluded.
    """
    text = FILES[0].read_text()
    assert len(text.splitlines()) <= 120
    assert len(re.findall(r"^\|[-| ]+\|$", text, re.MULTILINE)) <= 1
    prose = re.sub(r"(?ms)^```.*?^```$|^\|.*?$|^#.*?$|<!--.*?-->", "\n\n", text)
    prose = re.sub(r"\]\([^)]*\)", "]", prose)
    said = re.split(r"(?<=[.?:])\*{0,2}\s+(?=[A-Z`])|\n\n|^- ", prose, flags=re.MULTILINE)
    assert [sentence for sentence in said if len(sentence.split()) > 25] == []


def test_the_readme_leads_to_each_kind_of_page():
    """The README links to the index page of each folder, and all its links have targets."""
    links = re.findall(r"\]\(([^)#]+)", FILES[0].read_text())
    local = {ROOT / link for link in links if "://" not in link}
    assert all(target.is_file() for target in local)
    assert {file for file in FILES if file.name == "index.md"} <= local


def test_the_study_of_your_own_fits_in_thirty_lines():
    page = find_page("<!-- file angle.py -->")
    block = code_blocks(page.split("<!-- file angle.py -->")[1])[0]
    assert "study = Study(" in block
    assert len(block.splitlines()) <= 30


def test_there_are_examples():
    assert len(BLOCKS) >= 4


def lay_record(folder: Path) -> None:
    """Copy the record of the examples to the places where they read it."""
    pages = folder / "studies" / "pages"
    pages.mkdir(parents=True)
    for place in (folder, pages):
        for name in ("step.csv", "holds.csv", "protocol.csv"):
            shutil.copy(PAGES / name, place)


@pytest.mark.parametrize("number", range(len(BLOCKS)))
def test_python_runs_as_it_stands(number, tmp_path, tmp_path_factory, cluster, monkeypatch, capsys):
    """Each example runs in an empty directory, and prints the text that the page shows.

    The examples share workers, and results of named studies are copied.
    """
    monkeypatch.chdir(tmp_path)
    code, told = BLOCKS[number]
    if "outputs/rate_step_boundary.nc" in code:
        _dataset, file = named_results("rate_step_boundary", tmp_path_factory)
        (tmp_path / "outputs").mkdir()
        shutil.copy(file, tmp_path / "outputs")
    if "step.csv" in code or "holds.csv" in code:
        lay_record(tmp_path)
    monkeypatch.setattr(rsfstudy, "run", functools.partial(rsfstudy.run, client=cluster))
    names = {"__name__": "block"}
    exec(compile(code, f"block {number}", "exec"), names)
    if told:
        assert_same_output(capsys.readouterr().out, told)
    for name, test in list(names.items()):
        if name.startswith("test_"):
            test()


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_a_tutorial_runs_from_top_to_bottom(page, tmp_path, cluster, monkeypatch, capsys):
    """All blocks of a tutorial run in order in one directory.

    Python blocks share their variables. A block below a comment ``file NAME`` is written to this
    file. Commands run in this process. If a block of text follows a Python block, the block prints
    this text.
    """
    if page.name == "index.md":
        return
    lay_record(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(rsfstudy, "run", functools.partial(rsfstudy.run, client=cluster))
    names: dict = {"__name__": "block"}
    blocks = re.findall(
        r"(?:<!-- file (\S+) -->\n)?```(python|sh)\n(.*?)```(?:\n\n```text\n(.*?)```)?",
        page.read_text(),
        re.DOTALL,
    )
    assert blocks
    for file, language, code, told in blocks:
        if file:
            (tmp_path / file).write_text(code)
        elif language == "sh":
            for command in re.findall(r"^rsfstudy (.*)$", code.replace("\\\n", " "), re.MULTILINE):
                serial = ["--serial"] if command.startswith("run ") else []
                ran = call_main(*shlex.split(command.partition(" #")[0]), *serial)
                assert ran.returncode == 0, ran.stdout + ran.stderr
        else:
            capsys.readouterr()
            exec(compile(code, page.name, "exec"), names)
            if told:
                assert_same_output(capsys.readouterr().out, told)


def assert_same_output(ours: str, theirs: str) -> None:
    """Assert that two texts are equal except for the last digits of their numbers."""
    number = r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?"
    assert re.sub(number, "#", ours).split() == re.sub(number, "#", theirs).split()
    for one, other in zip(re.findall(number, ours), re.findall(number, theirs), strict=True):
        digits = len(other.partition("e")[0].partition(".")[2])
        last = 1.001 * 10.0**-digits * 10.0 ** int(other.partition("e")[2] or 0)
        assert abs(float(one) - float(other)) <= (last if digits else 0), (one, other)


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
    texts = (FILES[0].read_text(), find_page("<!-- fit command -->"))
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
        (
            laws.Law,
            laws.BUILT_IN_LAW_CLASS_BY_NAME["slowness"],
            ("evolution", "parameter_values", "check"),
        ),
        (measures.Measure, CriticalStep, ("compute", "error_scales")),
        (reductions.Reduction, reductions.Reduction, ("__call__", "derivatives")),
    ],
)
def test_help_states_the_signatures_of_what_one_writes(base, example, written):
    for name in written:
        takes = ", ".join(inspect.signature(getattr(example, name)).parameters)
        assert f"    {name}({takes}) -> " in base.__doc__


#: Options of ``dask worker`` and ``dask scheduler`` on the page about clusters.
OPTIONS_OF_DASK = {"--nthreads", "--host", "--interface", "--dashboard-address", "--no-dashboard"}


def test_commands_and_options_exist():
    shell = "\n".join(re.findall(r"```sh\n(.*?)```", TEXT, re.DOTALL))
    commands = set(re.findall(r"^rsfstudy (\w+)", shell, re.MULTILINE))
    assert len(commands) > 10
    for command in commands:
        assert command in cli.commands
    options = {
        option for command in cli.commands.values() for o in command.params for option in o.opts
    }
    named = set(re.findall(r"`(--[a-z-]+)", TEXT))
    assert named - options <= OPTIONS_OF_DASK


def test_the_table_of_promises_names_tests_that_exist():
    """The table names existing test modules, and no module is missing."""
    table = (
        find_page("| property | tests |").partition("| property | tests |")[2].partition("\n\n")[0]
    )
    named = set(re.findall(r"`(test_\w+\.py)`", table))
    here = Path(__file__).parent
    assert all((here / name).is_file() for name in named)
    about = ("runner", "resume", "faults", "clusters", "scale", "files", "bad_input", "study")
    assert {f"test_{name}.py" for name in about} <= named


def test_the_contents_of_results_files_are_as_described(tmp_path_factory):
    """The variables and attributes in the table exist in the file of a named study."""
    _dataset, path = named_results("rate_step_boundary", tmp_path_factory)
    table = find_page("<!-- file contents -->").partition("<!-- file contents -->")[2]
    rows = re.findall(r"^\| (.*?) \| (coordinate|variable|attribute) \|", table, re.MULTILINE)
    named = {
        kind: {name for row, of in rows if of == kind for name in re.findall(r"`(\w+)`", row)}
        for kind in ("coordinate", "variable", "attribute")
    }
    assert all(named.values())
    with xr.open_dataset(path) as dataset:
        assert named["coordinate"] <= set(dataset.coords)
        assert named["variable"] - {"NAME_error"} <= set(dataset.data_vars)
        assert named["attribute"] <= set(dataset.attrs)


def test_every_study_is_listed():
    for name in rsfstudy.studies():
        assert f"| `{name}` |" in TEXT


def test_every_law_is_listed():
    for name, law in laws.BUILT_IN_LAW_CLASS_BY_NAME.items():
        row = re.search(rf"^\| (?:`\w+`, )*`{name}`.*$", TEXT, re.MULTILINE)
        assert row, name
        own = set(list_part_field_names(law)) - set(list_part_field_names(laws.Law))
        assert all(f"`{field}`" in row[0] for field in own)
    assert all(
        f"`{field}`" in TEXT for field in list_part_field_names(laws.Law) if field != "b_over_a"
    )


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
