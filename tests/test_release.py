"""Tests of the files of a release: versions, recipe, citation, workflow and paper."""

import re
import tomllib
from pathlib import Path

import pytest
import yaml

import rsfstudy
from rsfstudy.study import list_study_names

ROOT = Path(rsfstudy.__file__).parents[1]
PAGES = ROOT / "studies" / "pages"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
RECIPE = yaml.safe_load((ROOT / ".github/recipe/recipe.yaml").read_text())
WORKFLOW = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text())
#: Names of packages on conda-forge that differ from the names on PyPI.
CONDA_NAMES = {"dask": "dask-core", "matplotlib": "matplotlib-base", "netCDF4": "netcdf4"}
#: Lines of the workflow and of the scripts that it runs.
COMMANDS = [
    step["run"] for job in WORKFLOW["jobs"].values() for step in job["steps"] if "run" in step
]


def split_requirement(text: str) -> tuple[str, str]:
    """Split a requirement into its name and its version specification."""
    name, bound = re.fullmatch(r"([\w-]+)\s*(.*)", text).groups()
    return name, bound.replace(" ", "")


def test_versions_agree():
    version = PROJECT["version"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    sections = re.findall(r"^## \[([\w.]+)\]", (PAGES / "changes.md").read_text(), re.MULTILINE)
    assert str(citation["version"]) == version
    assert RECIPE["context"]["version"] == version
    assert version in sections[:2]
    assert sections[0] in (version, "Unreleased")
    for page in PAGES.parent.rglob("*.md"):
        for tag in re.findall(r"rsfstudy:(\d+\.\d+\.\d+)", page.read_text()):
            assert tag == version, page


def test_the_change_log_has_the_standard_headings():
    text = (PAGES / "changes.md").read_text()
    newest = text.split("\n## [")[1]
    kinds = re.findall(r"^### (.*)$", newest, re.MULTILINE)
    allowed = ["Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"]
    assert kinds == [kind for kind in allowed if kind in kinds]
    assert len(kinds) >= 2


def test_the_recipe_has_the_dependencies_of_the_package():
    expected = dict(map(split_requirement, PROJECT["dependencies"]))
    expected = {CONDA_NAMES.get(name, name): bound for name, bound in expected.items()}
    python, *others = RECIPE["requirements"]["run"]
    assert dict(map(split_requirement, others)) == expected
    assert python == "python >=${{ python_min }}"
    assert f">={RECIPE['context']['python_min']}" == PROJECT["requires-python"]
    built = tomllib.loads((ROOT / "pyproject.toml").read_text())["build-system"]["requires"]
    assert set(map(split_requirement, built)) <= set(
        map(split_requirement, RECIPE["requirements"]["host"][1:])
    )


def test_the_recipe_has_the_entry_points_and_licences_of_the_package():
    scripts = [f"{name} = {target}" for name, target in PROJECT["scripts"].items()]
    assert RECIPE["build"]["python"]["entry_points"] == scripts
    assert RECIPE["about"]["license"] == PROJECT["license"]
    assert RECIPE["about"]["license_file"] == PROJECT["license-files"]
    assert all((ROOT / file).is_file() for file in RECIPE["about"]["license_file"])


def test_the_citation_is_complete():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert {"cff-version", "message", "title", "authors", "version", "license"} <= set(citation)
    assert citation["title"] == PROJECT["name"]
    assert citation["license"] == PROJECT["license"]
    (paper,) = citation["references"]
    assert paper["doi"] in (ROOT / "README.md").read_text()


def test_the_workflow_runs_existing_scripts_and_studies():
    package = (ROOT / ".ci/package").read_text()
    scripts = [command for command in COMMANDS if command.startswith(".ci/")]
    assert scripts == [".ci/run", ".ci/package"]
    assert all((ROOT / script).stat().st_mode & 0o111 for script in scripts)
    recipe = [line for test in RECIPE["tests"] for line in test.get("script", [])]
    text = "\n".join([*COMMANDS, *recipe])
    studies = re.findall(r"rsfstudy (?:run|check) (\w+)", text)
    studies += re.search(r"for study in ([\w ]+);", package)[1].split()
    assert len(studies) >= 6
    assert set(studies) <= set(list_study_names())
    for command in ("-m build", 'twine" check --strict', "rsfstudy check", 'pip" check'):
        assert command in package


def test_windows_runs_the_commands_in_powershell():
    job = WORKFLOW["jobs"]["windows"]
    assert job["runs-on"].startswith("windows")
    assert job["defaults"]["run"]["shell"] == "pwsh"
    lines = [line for step in job["steps"] for line in step.get("run", "").splitlines()]
    assert any(line.startswith(r".venv\Scripts\rsfstudy fit ") for line in lines)
    assert not [line for line in lines if "/bin/" in line or "&&" in line]
    (record,) = re.findall(r"fit (\S+)", "\n".join(lines))
    assert (ROOT / record).is_file()


@pytest.mark.parametrize("name", ["rsfmodel", "RSFit3000", "QDYN", "DiaBayes"])
def test_the_paper_compares_other_software(name):
    table = [line for line in (PAGES / "paper.md").read_text().splitlines() if line[:1] == "|"]
    assert [line for line in table if line.startswith(f"| {name} (")]


def test_references_of_the_paper_are_listed_and_cited():
    text, references = (PAGES / "paper.md").read_text().split("\n## References\n")
    listed = re.findall(r"^- (?:van den )?([\w-]+),? .*?\((\d{4})\)", references, re.MULTILINE)
    cited = set()
    for group in re.findall(r"\(([^()]*\d{4})\)", text):
        for citation in group.split(";"):
            citation = " ".join(citation.split())
            author, year = re.search(r"([A-Z][\w-]+)[^;]* (\d{4})$", citation).groups()
            cited.add((author, year))
    assert cited == set(listed)
