"""A study in a file of the user's own: it runs by its path, and what is wrong with it is told."""

import sys

import pytest
from running import call

import rsfstudy
from rsfstudy.declare import catalogue
from rsfstudy.errors import InvalidValue, RunError

DECLARATION = """
from rsfstudy import Axis, Scene, Study
from rsfstudy.measures.critical_step import CriticalStep

study = Study(
    name="mine",
    title="My own",
    base=Scene(),
    axes=[Axis("phi", [55, 65])],
    measure=CriticalStep(of="displacement_step"),
)
"""

OWN_MEASURE = """
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsfstudy import Axis, Scene, Study
from rsfstudy.measures import Measure, Outcome
from rsfstudy.status import Status


@dataclass(frozen=True)
class Stiffness(Measure):
    name: ClassVar[str] = "spring"
    headline = "spring"
    variables = {"spring": (), "spring_error": ()}
    typical_work = 1

    def find(self, scene, accuracy, meter):
        return Outcome(Status.OK, {"spring": scene.stiffness, "spring_error": 0.0})


study = Study(
    name="own", title="My own measure", base=Scene(), axes=[Axis("phi", [55, 65])],
    measure=Stiffness(),
)
"""


def written(tmp_path, text: str) -> str:
    path = tmp_path / "mine.py"
    path.write_text(text)
    return str(path)


def test_a_file_runs_by_its_path(tmp_path):
    ran = call("run", written(tmp_path, DECLARATION), "--serial", "--output", tmp_path)
    assert ran.returncode == 0, ran.stderr
    assert (tmp_path / "mine.nc").exists()
    assert (tmp_path / "mine.png").exists()
    assert rsfstudy.open("mine", tmp_path).sizes["phi"] == 2


def test_a_measure_of_the_file_reaches_the_workers(tmp_path, cluster):
    dataset = rsfstudy.run(
        written(tmp_path, OWN_MEASURE), client=cluster, output=tmp_path, progress=False
    )
    assert (dataset.status == 0).all(), dataset.message.values
    assert float(dataset.spring[0]) == rsfstudy.Scene(phi=55).stiffness
    assert "study_file_mine" not in sys.modules


CLAIM = """
from rsfstudy.declare.claims import Claim

study = dataclasses.replace(study, claims=[Claim(
    id="M1", statement="", source="", published=1.0, tolerance=0.1, reason="", {}
)])
"""


@pytest.mark.parametrize(
    ("names", "complaint"),
    [
        (
            'variable="critcal_displacement", where={"phi": 55.0}',
            "'critcal_displacement': is no variable.*M1",
        ),
        (
            'variable="critical_displacement", where={"ph": 55.0}',
            "'ph': is no coordinate.*M1.*'phi'",
        ),
        (
            'variable="critical_displacement", where={"phi": 55.0}, minus={"b": 1.0}',
            "'b': is no coordinate.*M1",
        ),
        ('variable="critical_displacement", where={"phi": 50.0}', "'phi': 50.0.*no place.*M1"),
    ],
)
def test_a_claim_on_what_is_not_there_is_told_before_anything_is_computed(
    names, complaint, tmp_path
):
    """It would never apply, and so never be checked."""
    file = written(tmp_path, "import dataclasses" + DECLARATION + CLAIM.replace("{}", names))
    with pytest.raises(InvalidValue, match=complaint):
        rsfstudy.run(file, output=tmp_path / "results")
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("study = 1", "declares no study"),
        ("", "declares no study"),
        ("x = 1\nx +", "line 2: invalid syntax"),
        ("\n\n1 / 0", "raises ZeroDivisionError, line 3: division by zero"),
        ("from rsfstudy import Scene\nScene(alfa=1)", "line 2: field = 'alfa'"),
        ("from rsfstudy import Scene\nScene(a=-1)", "line 2: a = -1.0: must be greater than 0"),
        ("raise SystemExit('no')", "raises SystemExit, line 1: no"),
    ],
)
def test_what_is_wrong_with_a_file_is_told(tmp_path, text, complaint):
    with pytest.raises(InvalidValue) as refused:
        catalogue.load(written(tmp_path, text))
    assert complaint in str(refused.value)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(InvalidValue, match="is no file"):
        catalogue.load(str(tmp_path / "nothing.py"))


def test_a_file_may_have_helpers_beside_it_and_not_the_name_of_a_named_study(tmp_path):
    (tmp_path / "my_angles.py").write_text("angles = [55, 65]")
    helped = "from my_angles import angles\n" + DECLARATION.replace("[55, 65]", "angles")
    assert catalogue.load(written(tmp_path, helped)).size == 2
    taken = DECLARATION.replace('"mine"', '"stress_drop"')
    with pytest.raises(InvalidValue, match="the name of a named study"):
        catalogue.load(written(tmp_path, taken))


def test_a_reduction_that_does_not_fit_is_told_before_anything_is_computed(tmp_path):
    unfit = DECLARATION.replace(
        "measure=",
        'reductions=[LinearFit(name="s", of="critical_displacement", on="log_load")], measure=',
    )
    unfit = "from rsfstudy.reduce import LinearFit\n" + unfit
    with pytest.raises(InvalidValue, match="must be a coordinate along one dimension"):
        rsfstudy.run(written(tmp_path, unfit), output=tmp_path, progress=False)
    assert not list(tmp_path.glob("*.sqlite"))


def test_cells_that_cannot_be_reduced_are_kept(tmp_path):
    """A reduction that fits the empty lattice and fails on the numbers loses nothing."""
    failing = """
from dataclasses import dataclass
from typing import ClassVar

import xarray as xr

from rsfstudy.reduce import Reduction


@dataclass(frozen=True)
class Failing(Reduction):
    kind: ClassVar[str] = "failing"

    def __call__(self, dataset):
        if dataset[self.of].notnull().any():
            raise ZeroDivisionError("on numbers")
        return xr.Dataset()

"""
    unfit = DECLARATION.replace(
        "measure=", 'reductions=[Failing(name="s", of="critical_displacement")], measure='
    )
    with pytest.raises(RunError, match="cannot be reduced .ZeroDivisionError: on numbers"):
        rsfstudy.run(written(tmp_path, failing + unfit), output=tmp_path, progress=False, workers=0)
    kept = rsfstudy.open(tmp_path / "mine.partial.nc")
    assert kept.critical_displacement.notnull().all()
