"""Tests of user-defined study files and of their error messages."""

from dataclasses import dataclass
from typing import ClassVar

import pytest
import xarray as xr
from study_runs import run, study_of

import rsfstudy
from rsfstudy import Axis
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.errors import InvalidValue, RunError
from rsfstudy.reductions import Reduction
from rsfstudy.study import study_loader

DECLARATION = """
from rsfstudy import Axis, Scene, Study
from rsfstudy.critical_steps.critical_step import CriticalStep

study = Study(
    name="mine",
    title="My own",
    base=Scene(),
    axes=[Axis("phi", [55, 65])],
    measure=CriticalStep(of="displacement_step"),
)
"""


def written(tmp_path, text: str) -> str:
    path = tmp_path / "mine.py"
    path.write_text(text)
    return str(path)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("study = 1", "does not define a study"),
        ("", "does not define a study"),
        ("x = 1\nx +", "line 2: invalid syntax"),
        ("\n\n1 / 0", "raises ZeroDivisionError, line 3: division by zero"),
        ("from rsfstudy import Scene\nScene(alfa=1)", "line 2: 'alfa'"),
        ("from rsfstudy import Scene\nScene(a=-1)", "line 2: 'a' must be greater than 0"),
        ("raise SystemExit('no')", "raises SystemExit, line 1: no"),
    ],
)
def test_what_is_wrong_with_a_file_is_told(tmp_path, text, complaint):
    with pytest.raises(InvalidValue) as refused:
        study_loader.load_study(written(tmp_path, text))
    assert complaint in str(refused.value)


def test_a_file_that_is_named_without_its_suffix_is_told(tmp_path, monkeypatch):
    written(tmp_path, DECLARATION)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(
        InvalidValue, match="To load the file in the current directory, write mine.py"
    ):
        study_loader.load_study("mine")


def test_a_file_may_have_helpers_beside_it_and_not_the_name_of_a_named_study(tmp_path):
    (tmp_path / "my_angles.py").write_text("angles = [55, 65]")
    helped = "from my_angles import angles\n" + DECLARATION.replace("[55, 65]", "angles")
    assert study_loader.load_study(written(tmp_path, helped)).size == 2
    taken = DECLARATION.replace('"mine"', '"stress_drop"')
    with pytest.raises(InvalidValue, match="rsfstudy already has a study with this name"):
        study_loader.load_study(written(tmp_path, taken))


@dataclass(frozen=True)
class Failing(Reduction):
    kind: ClassVar[str] = "failing"

    def __call__(self, dataset):
        if dataset[self.of].notnull().any():
            raise ZeroDivisionError("on numbers")
        return xr.Dataset()


def test_cells_that_cannot_be_reduced_are_kept(tmp_path):
    """The cells are kept if a reduction fails after the run.

    The reduction succeeds for the empty lattice of the dry run.
    """
    measure = CriticalStep(of="displacement_step")
    failing = [Failing("s", "critical_displacement")]
    study = study_of("mine", measure, Axis("phi", [55, 65]), reductions=failing)
    with pytest.raises(RunError, match="a reduction failed .ZeroDivisionError: on numbers"):
        run(study, output=tmp_path)
    kept = rsfstudy.open(tmp_path / "mine.partial.nc")
    assert kept.critical_displacement.notnull().all()
