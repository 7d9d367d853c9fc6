"""Tests of the digests of the physics and of user-defined measures.

The digest is equal for equal code in every process, and changes if any code that a measure
uses changes. Cells with different digests are not mixed.
"""

import dataclasses
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
from rsfstudy.named_studies import effects

import rsfstudy
from rsfstudy import measures
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.errors import DataError, RunError
from rsfstudy.execution import code_digest, provenance
from rsfstudy.execution.module_import_graph import ModuleImportGraph
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.measures import Outcome
from rsfstudy.reductions import Reduction
from rsfstudy.status import Status
from rsfstudy.study import named_study_index, study_loader
from rsfstudy.study.named_study_index import NAMED_STUDIES_PACKAGE

HELPER = """
import functools
import numpy as np

FACTOR = 1.0
TABLE = {"x": [1.0, 2.0], "y": np.ones(2)}
UNUSED = 3.0

def twice(x):
    return 2.0 * x * len(TABLE["x"])

@functools.lru_cache
def kept(x):
    return x

class Base:
    offset = 0.0

    @property
    def more(self):
        return self.offset + FACTOR

class Tool(Base):
    def __init__(self):
        self.extra = 0.0

    @staticmethod
    def shifted(x):
        return x + 1.0

def unused():
    return 1
"""

MEASURE = """
from dataclasses import dataclass
from typing import ClassVar

import helper
from helper import Tool, kept
from rsfstudy import Axis, Scene, Study
from rsfstudy.measures import Measure, Outcome
from rsfstudy.status import Status

SCALE = 1.0
TOOL = Tool()


def inner(x):
    return (lambda y: y * SCALE)(x)


@dataclass(frozen=True)
class Own(Measure):
    name: ClassVar[str] = "own"
    primary_output = "total"
    variables = {"total": ()}
    typical_rhs_evaluations = 1
    least: float = 0.0

    def compute(self, scene, integrator):
        total = inner(helper.twice(scene.b_over_a)) + kept(Tool.shifted(TOOL.more))
        if total in {4.0, 5.0, 6.0}:
            total += 1.0
        return Outcome(Status.OK, {"total": total})


study = Study(
    name="own", title="My own", base=Scene(), axes=[Axis("b_over_a", [2.0, 3.0])], measure=Own()
)
"""


FOUND = 'compute(self, scene, integrator):\n        """A remark."""'


def study_in(place, *, helper=HELPER, measure=MEASURE):
    place.mkdir(exist_ok=True)
    (place / "helper.py").write_text(helper)
    (place / "mine.py").write_text(measure)
    return study_loader.load_study(str(place / "mine.py"))


def digest(study):
    return code_digest.digest_user_classes(type(study.measure))


def test_a_measure_of_rsfstudy_has_its_version():
    assert code_digest.digest_user_classes(CriticalStep) == "none"


@pytest.mark.parametrize(
    ("part", "old", "new"),
    [
        ("helper", "FACTOR = 1.0", "FACTOR = 100.0"),
        ("helper", '"x": [1.0, 2.0]', '"x": [1.0, 2.5]'),
        ("helper", "np.ones(2)", "np.zeros(2)"),
        ("helper", "return 2.0 * x", "return 3.0 * x"),
        ("helper", "    return x\n", "    return -x\n"),
        ("helper", "offset = 0.0", "offset = 1.0"),
        ("helper", "self.extra = 0.0", "self.extra = 1.0"),
        ("helper", "self.offset + FACTOR", "self.offset - FACTOR"),
        ("helper", "return x + 1.0", "return x - 1.0"),
        ("measure", "SCALE = 1.0", "SCALE = 2.0"),
        ("measure", "y * SCALE", "y / SCALE"),
        ("measure", "5.0, 6.0}", "5.0, 7.0}"),
        ("measure", "total += 1.0", "total += 2.0"),
    ],
)
def test_whatever_a_measure_draws_on_changes_its_digest(part, old, new, tmp_path):
    before = {"helper": HELPER, "measure": MEASURE}
    assert old in before[part]
    after = {**before, part: before[part].replace(old, new)}
    same = study_in(tmp_path / "again")
    assert digest(study_in(tmp_path / "before", **before)) == digest(same)
    assert digest(study_in(tmp_path / "after", **after)) != digest(same)


@pytest.mark.parametrize(
    ("part", "old", "new"),
    [
        ("helper", "UNUSED = 3.0", "UNUSED = 4.0"),
        ("helper", "    return 1\n", "    return 2\n"),
        ("measure", "[2.0, 3.0]", "[2.0, 2.5, 3.0]"),
        ("measure", "SCALE = 1.0", "# a remark\n\nSCALE = 1.0"),
        ("measure", "compute(self, scene, integrator):", FOUND),
        ("measure", "class Own(Measure):", 'class Own(Measure):\n    """A remark."""\n'),
    ],
)
def test_what_it_does_not_draw_on_does_not(part, old, new, tmp_path):
    before = {"helper": HELPER, "measure": MEASURE}
    assert old in before[part]
    after = {**before, part: before[part].replace(old, new)}
    assert digest(study_in(tmp_path / "a", **after)) == digest(study_in(tmp_path / "b"))


def test_the_code_of_a_measure_within_another_counts(tmp_path):
    head = "from rsfstudy.measure_base.elasticities import Elasticities\n" + MEASURE
    text = head.replace("measure=Own()", 'measure=Elasticities(Own(), ("b_over_a",))')
    found = set()
    for number, helper in enumerate((HELPER, HELPER, HELPER.replace("2.0 * x", "3.0 * x"))):
        study = study_in(tmp_path / str(number), helper=helper, measure=text)
        found.add(provenance.collect_run_fingerprint(study, [study.base])["own_code"])
    assert len(found - {"none"}) == 2


def test_it_is_the_same_in_other_processes(tmp_path):
    """The digest is independent of the hash seed.

    The code may come from a script or from the command line.
    """
    expected = digest(study_in(tmp_path))
    script = tmp_path / "script.py"
    ask = (
        "\nfrom rsfstudy.execution import code_digest\nprint(code_digest.digest_user_classes(Own))"
    )
    script.write_text(MEASURE + ask)
    for seed, words in (("1", [str(script)]), ("2", ["-c", MEASURE + ask])):
        said = subprocess.run(
            [sys.executable, *words],
            capture_output=True,
            text=True,
            check=True,
            cwd=tmp_path,
            env={"PYTHONHASHSEED": seed, "PYTHONPATH": str(tmp_path)},
        )
        assert said.stdout.strip() == expected


def test_cells_of_other_code_are_not_mixed(tmp_path):
    options = {"output": tmp_path / "results", "workers": 0, "progress": False}
    first = rsfstudy.run(study_in(tmp_path), **options)
    longer = study_in(tmp_path).with_(b_over_a=[2.0, 3.0, 4.0])
    assert rsfstudy.run(longer, **options).total.values[:2].tolist() == first.total.values.tolist()
    edited = HELPER.replace("return 2.0 * x", "return 200.0 * x")
    with pytest.raises(DataError, match="own_code: .* in the journal, .* in this run"):
        rsfstudy.run(study_in(tmp_path, helper=edited), **options)


def test_helpers_reach_the_workers_and_those_of_other_files_do_not_mix(tmp_path, cluster):
    """Helper modules with the same name are kept apart in one process."""
    # The cached function cannot be serialised.
    plain = HELPER.replace("@functools.lru_cache\n", "")
    other = plain.replace("return 2.0 * x", "return 3.0 * x")
    one, two = study_in(tmp_path / "one", helper=plain), study_in(tmp_path / "two", helper=other)
    assert "helper" not in sys.modules
    for study in (one, two):
        here = rsfstudy.run(study, workers=0, output=None, progress=False)
        there = rsfstudy.run(study, client=cluster, output=None, progress=False)
        assert here.total.values.tolist() == there.total.values.tolist()
        factor = 2.0 if study is one else 3.0
        assert here.total.values.tolist() == [factor * 2 * b + 2.0 for b in (2.0, 3.0)]


def test_a_worker_with_another_helper_is_refused(tmp_path, monkeypatch, cluster):
    """A worker is rejected if its version of a shared module differs."""
    text = textwrap.dedent(
        HELPER + MEASURE.replace("import helper\nfrom helper import Tool, kept", "")
    )
    (tmp_path / "shared_by_both.py").write_text(text.replace("helper.twice", "twice"))
    monkeypatch.syspath_prepend(tmp_path)
    import shared_by_both

    with pytest.raises(
        RunError, match="a worker process cannot load the measure.*'shared_by_both'"
    ):
        rsfstudy.run(shared_by_both.study, client=cluster, output=None, progress=False)
    cluster.run(lambda place: sys.path.insert(0, place), str(tmp_path))
    assert rsfstudy.run(shared_by_both.study, client=cluster, output=None, progress=False)
    monkeypatch.setattr(shared_by_both, "FACTOR", 100.0)
    with pytest.raises(
        RunError, match="a worker has own_code .*, but this run .* same versions and files"
    ):
        rsfstudy.run(shared_by_both.study, client=cluster, output=None, progress=False)


def physics_of(study):
    return provenance.collect_run_fingerprint(study, [study.base])["physics"]


def with_measures_of_their_own():
    """Return the modules of named studies that define their own measure."""
    loaded = [study_loader.load_study(name) for name in named_study_index.list_study_names()]
    homes = {study.name: type(study.measure).__module__ for study in loaded}
    return [
        sys.modules[home]
        for name, home in homes.items()
        if home == f"{NAMED_STUDIES_PACKAGE}.{name}"
    ]


def test_a_measure_in_the_file_of_a_named_study_is_no_code_of_ones_own():
    fingerprint = provenance.collect_run_fingerprint(effects.study, [effects.study.base])
    assert fingerprint["own_code"] == "none"
    assert "named_studies.effects" in fingerprint["physics"]


def digest_of_edited(module, edits, monkeypatch):
    with monkeypatch.context() as patch:
        for name, value in edits.items():
            patch.setattr(module, name, value)
        return physics_of(module.study)


@pytest.mark.parametrize("module", with_measures_of_their_own(), ids=lambda m: m.__name__)
def test_what_else_stands_in_the_file_of_a_study_decides_no_number(module, monkeypatch):
    """The digest ignores figure, axes, claims and reductions of a study."""
    before = physics_of(module.study)
    others = [n for n, v in vars(module).items() if n == "figure" or is_reduction(v)]
    edited = dataclasses.replace(module.study, claims=[], axes=module.study.axes[:1], plot="lines")
    edits = dict.fromkeys(others) | {"study": edited}
    assert digest_of_edited(module, edits, monkeypatch) == before


def is_reduction(value):
    return isinstance(value, type) and issubclass(value, Reduction)


def test_what_its_measure_draws_on_does(monkeypatch):
    before = physics_of(effects.study)
    timed = lambda equations, state: 1.0  # noqa: E731
    for edits in (
        {"_TIMING_REPEATS": 26},
        {"_time_right_hand_side": timed},
        {"_CYCLE_MEASURE": LimitCycle(phases=3)},
    ):
        assert digest_of_edited(effects, edits, monkeypatch) != before
    monkeypatch.setattr(effects.EffectCost, "compute", lambda *_: Outcome(Status.OK))
    assert physics_of(effects.study) != before


LAW = """
def rate(x):
    \"\"\"The rate.\"\"\"
    return 2.0 * x  # twice


class Law:
    \"\"\"A law.\"\"\"

    def slope(self, x, scale=1.0):
        assert x
        return [scale for _ in range(2)]
"""


@pytest.mark.parametrize(
    ("old", "new", "same"),
    [
        ("The rate.", "What it gives.", True),
        ("A law.", "A law\n\n    of rocks.", True),
        ("  # twice", "", True),
        ("\n\n\nclass", "\n\n# of rocks\n\n\n\nclass", True),
        ("2.0 * x", "2.0 / x", False),
        ("2.0 * x", "(2.0 + 2e-16) * x", True),  # The sum rounds to the same float.
        ("2.0 * x", "(2.0 + 5e-16) * x", False),
        ("scale=1.0", "scale=-1.0", False),
        ("range(2)", "range(3)", False),
    ],
)
def test_of_the_physics_its_code_counts_and_no_remark(old, new, same, tmp_path):
    """The digest depends on code, but not on docstrings and comments."""
    for name, text in (("before", LAW), ("after", LAW.replace(old, new))):
        (tmp_path / name / "slider").mkdir(parents=True)
        (tmp_path / name / "slider" / "law.py").write_text(text)
    assert old in LAW
    before, after = (
        ModuleImportGraph(
            provenance.read_source_files_affecting_results(tmp_path / name)
        ).compute_digests()
        for name in ("before", "after")
    )
    assert before.keys() == {"slider.law"}
    assert (before == after) is same


def test_the_digest_of_the_physics_is_that_of_its_files():
    package = Path(rsfstudy.__file__).parent
    files = provenance.read_source_files_affecting_results(package)
    assert {"slider/friction.py", "motion/motion_loop.py", "measure_base/measure.py"} <= set(files)
    moved = {**files, "slider/moved.py": files["slider/friction.py"]}
    digests = [ModuleImportGraph(each).combined_digest for each in (files, moved)]
    assert digests[0] == provenance.collect_code_fingerprint()["physics"] != digests[1]


@pytest.mark.parametrize("name", ["triggering", "hard_cases"])
def test_cached_properties_of_a_study_do_not_change_its_digest(name):
    """The digest is the same before and after the use of a study."""
    study = study_loader.load_study(name)
    fresh = code_digest.digest_measures_of_named_studies(study.measure.result_determining_classes)
    values = [
        value
        for kind in study.measure.result_determining_classes
        for value in vars(sys.modules[kind.__module__]).values()
    ]
    values += [part for value in values if isinstance(value, dict) for part in value.values()]
    used = [value.variables for value in values if isinstance(value, measures.Measure)]
    assert used
    assert (
        code_digest.digest_measures_of_named_studies(study.measure.result_determining_classes)
        == fresh
    )
