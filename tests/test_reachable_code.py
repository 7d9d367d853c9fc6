"""Tests of the code that a journal depends on.

A journal is resumed unless code has changed that its measure or the parts of its scenes can reach.
"""

import json
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest

import rsfstudy
from rsfstudy import Axis, Scene, Study
from rsfstudy.errors import DataError
from rsfstudy.execution import cell_computation, provenance
from rsfstudy.execution.cell_plan import compute_cell_key
from rsfstudy.execution.module_import_graph import ModuleImportGraph
from rsfstudy.measures import CriticalStep, Elasticities, LimitCycle, LinearStability
from rsfstudy.slider import part_registry
from rsfstudy.storage import run_fingerprints, stored_declarations

PACKAGE = Path(rsfstudy.__file__).parent
SOURCES = provenance.read_source_files_affecting_results(PACKAGE)
SLIP = Scene(law="slip", normal_stress="constant", b_over_a=1.5)
OPTIONS = {"workers": 0, "progress": False, "rtol": 1e-4}


def reach(measure, *scenes):
    return provenance.digest_modules_affecting_results(measure, scenes)


def edit(monkeypatch, path):
    """Change the last function of one source file, as if it had been changed before the import."""
    head, found, tail = SOURCES[path].rpartition(b"    return ")
    changed = {path: head + found + b"not " + tail}
    assert (
        ModuleImportGraph(changed).compute_digests()
        != ModuleImportGraph({path: SOURCES[path]}).compute_digests()
    )
    monkeypatch.setattr(
        provenance, "_import_graph_of_running_code", ModuleImportGraph({**SOURCES, **changed})
    )


def study_of_critical_steps(*laws):
    return Study(
        name="steps",
        title="Critical steps",
        base=SLIP.with_(stiffness_ratio=1.5),
        axes=[Axis("law", laws)],
        measure=CriticalStep(of="load_velocity_ratio"),
    )


def resume(study, tmp_path, monkeypatch):
    """Run a study whose cells must all be in the journal."""
    with monkeypatch.context() as patch:
        patch.setattr(cell_computation, "compute_cell", None)
        return rsfstudy.run(study, output=tmp_path, **OPTIONS)


def test_limit_cycles_do_not_affect_critical_steps(tmp_path, monkeypatch):
    study = study_of_critical_steps("slip")
    before = rsfstudy.run(study, output=tmp_path, **OPTIONS)
    edit(monkeypatch, "limit_cycles/return_map.py")
    after = resume(study, tmp_path, monkeypatch)
    assert after.critical_velocity_ratio.values == before.critical_velocity_ratio.values
    edit(monkeypatch, "slider/friction_relation.py")
    told = r"physics \(slider.friction_relation\): \w{16} in the journal, \w{16} in this run"
    with pytest.raises(DataError, match=told):
        rsfstudy.run(study, output=tmp_path, **OPTIONS)


def test_a_longer_axis_adds_the_modules_of_its_laws(tmp_path, monkeypatch):
    rsfstudy.run(study_of_critical_steps("slip"), output=tmp_path, **OPTIONS)
    edit(monkeypatch, "slider/laws/slowness.py")
    resume(study_of_critical_steps("slip"), tmp_path, monkeypatch)
    both = study_of_critical_steps("slip", "slowness")
    found = rsfstudy.run(both, output=tmp_path, **OPTIONS)
    stored = json.loads(found.attrs["provenance"])["fingerprint"]["physics"]
    assert {"slider.laws.slip", "slider.laws.slowness"} <= set(stored)
    resume(study_of_critical_steps("slip"), tmp_path, monkeypatch)  # It keeps both modules.
    monkeypatch.setattr(provenance, "_import_graph_of_running_code", ModuleImportGraph(SOURCES))
    with pytest.raises(DataError, match=r"physics \(slider.laws.slowness\)"):
        rsfstudy.run(both, output=tmp_path, **OPTIONS)
    with closing(sqlite3.connect(tmp_path / "steps.cells.sqlite")) as db:
        ((text,),) = db.execute("SELECT json FROM fingerprint")
    assert json.loads(text)["physics"]["slider.laws.slowness"] == stored["slider.laws.slowness"]


def test_measures_reach_the_modules_of_their_topic():
    steps, cycles = reach(CriticalStep(), SLIP), reach(LimitCycle(), SLIP)
    shared = {"slider.friction", "slider.scene", "motion.motion_loop", "measure_base.measure"}
    assert shared | {"motion.steppers.scipy", "motion.compiled.numba_backend"} <= {*steps} & {
        *cycles
    }
    for modules, own, others in (
        (steps, "critical_steps", "limit"),
        (cycles, "limit", "critical_"),
    ):
        assert any(name.startswith(own) for name in modules)
        assert not any(name.startswith((others, "responses", "fitting")) for name in modules)
    linear = reach(LinearStability(), SLIP)
    assert not any(name.startswith(("critical_", "limit_", "fitting")) for name in linear)
    within = Elasticities(LimitCycle(), ("b_over_a",))
    assert {*cycles, "measure_base.elasticities"} == {*reach(within, SLIP)}


def test_scenes_reach_the_modules_of_their_parts():
    dilatant = SLIP.with_(law="slowness", fluid="dilatant", inertia=True)
    modules = reach(CriticalStep(), SLIP, dilatant)
    added = {"laws.slowness", "fluid.dilatant", "dynamics.inertia"}
    assert {f"slider.{name}" for name in added} <= {*modules} - {*reach(CriticalStep(), SLIP)}
    assert "slider.laws.composite" not in modules


def test_a_measure_of_a_user_may_reach_all_modules():
    class Own(LinearStability):
        """Measure that is defined outside rsfstudy."""

    assert reach(Own(), SLIP) == ModuleImportGraph(SOURCES).compute_digests()


FILES = {
    "slider/__init__.py": (
        "from rsfstudy._lazy_exports import build_lazy_export_functions\n"
        "if TYPE_CHECKING:\n    from rsfstudy.slider.b import B\n"
        "__getattr__, __dir__ = build_lazy_export_functions(\n"
        "    __name__, {'slider.a': ('A as a', 'C'), 'slider.b': ('B',)})\n"
    ),
    "slider/a.py": "A = 1\n",
    "slider/b.py": "B = 1\n",
    "slider/laws/__init__.py": "from rsfstudy.slider.a import A\n",
    "slider/laws/c.py": "C = 1\n",
}


@pytest.mark.parametrize(
    ("source", "modules"),
    [
        ("from rsfstudy.slider import a", "slider.a"),
        ("from rsfstudy.slider import C, a", "slider.a"),
        ("from rsfstudy.slider import B as A", "slider.b"),
        ("from rsfstudy.slider import former_name", "slider.a slider.b"),
        ("import rsfstudy.slider", "slider.a slider.b"),
        ("import rsfstudy.slider.b", "slider.b"),
        ("from rsfstudy import slider", "slider.a slider.b"),
        ("from rsfstudy.slider import laws", "slider.a slider.laws"),
        ("from rsfstudy.slider.laws import c", "slider.a slider.laws slider.laws.c"),
        ("def f():\n    def g():\n        from rsfstudy.slider.b import B", "slider.b"),
        ("importlib.import_module('rsfstudy.slider.b')", "slider.b"),
        ("if TYPE_CHECKING:\n    from rsfstudy.slider import B", ""),
        ("if TYPE_CHECKING:\n    X = 1\nelse:\n    from rsfstudy.slider import B", "slider.b"),
        ("import os.path\nfrom rsfstudy.errors import E\n'rsfstudy.slider.nothing'", ""),
    ],
)
def test_imports_are_found_in_the_sources(source, modules):
    texts = {path: text.encode() for path, text in {**FILES, "motion/m.py": source}.items()}
    found = ModuleImportGraph(texts).compute_digests(["rsfstudy.motion.m"])
    assert found.keys() == {"motion.m", *modules.split()}


def test_no_other_package_leads_to_the_physics():
    """The graph contains all modules through which physics can import physics."""
    allowed = {"quantities", "errors", "status", "vocabulary", "formatting", "object_digest"}
    allowed |= {
        "exception_conversion",
        "argument_checks",
        "netcdf_encoding",
        "_deprecation",
        "defaults",
    }
    allowed |= {"_lazy_exports"} | {path.partition("/")[0] for path in SOURCES}
    for path, text in SOURCES.items():
        lines = [line.split() for line in text.decode().splitlines()]
        for words in lines:
            if len(words) > 1 and words[0] in ("from", "import") and "rsfstudy." in words[1]:
                assert words[1].split(".")[1] in allowed, f"{path}: {' '.join(words)}"


@pytest.mark.parametrize("older", ["0123456789abcdef", None, 5])
def test_older_fingerprints_have_one_digest(older):
    now = {"physics": {"slider.friction": "ab", "slider.scene": "cd"}}
    ((name, (there, here)),) = run_fingerprints.find_fingerprint_differences(
        {"physics": older}, now
    ).items()
    assert (name, there, len(here)) == ("physics", older, 16)
    assert run_fingerprints.merge_fingerprints({"physics": older}, now) == now


def test_a_difference_lists_the_first_modules_that_changed():
    then, now = ({"physics": {f"m{n:02}": text for n in range(20)}} for text in ("ab", "cd"))
    now["physics"]["m00"] = "ab"
    ((name, (there, here)),) = run_fingerprints.find_fingerprint_differences(then, now).items()
    assert (name, there == here) == ("physics (m01, m02, m03, ..., m19)", False)
    assert run_fingerprints.find_fingerprint_differences(then, then) == {}


# ---- keys of cells -------------------------------------------------------------------------------

#: Keys of cells in existing journals.
KEYS = {
    "318edc35dc008c3caf962f5a3436926a": (Scene(), CriticalStep(of="load_velocity_ratio")),
    "226a20e65746faa351e49755c6b94118": (
        Scene(law="slowness", normal_stress="constant", a=0.01, b_over_a=1.5),
        LimitCycle(),
    ),
    "71022eb4b36fe8d374ce1d31e25e2974": (Scene(fluid="dilatant", inertia=True), LimitCycle()),
    "bc41a1c356e58173ae49b62e6db35e7c": (
        Scene(oscillation_amplitude=0.1, oscillation_begin=2.0),
        CriticalStep(of="load_velocity_ratio"),
    ),
}


@pytest.mark.parametrize("key", KEYS)
def test_keys_of_existing_journals_stay_valid(key):
    assert compute_cell_key(*KEYS[key]).hex() == key


#: Program that adds a part and a field, as a later version of rsfstudy may do, before it imports
#: the rest of the package.
ADDED_PART = """
from dataclasses import dataclass, fields, make_dataclass
from rsfstudy.slider import fluid, slider_parameters
from rsfstudy.slider.fluid.drained import DrainedFluid
from rsfstudy.slider.parts import number

@dataclass(frozen=True, kw_only=True)
class Warm(DrainedFluid):
    name = "warm"
    warmth: float = number(2.0, "$w$", "1", "warmth", omit_if_default=True)

fluid.BUILT_IN_FLUID_CLASS_BY_NAME["warm"] = Warm
old = slider_parameters.SliderParameters
@dataclass(frozen=True, kw_only=True)
class SliderParameters(old):
    lean: float = number(0.5, "$l$", "1", "lean", omit_if_default=True)
SliderParameters.__qualname__ = old.__qualname__
slider_parameters.SliderParameters = SliderParameters

import sys
sys.path.insert(0, {tests!r})
import test_reachable_code as tests
from rsfstudy import Scene
rebuild = tests.stored_declarations.build_scene_from_stored_fields
for key, cell in tests.KEYS.items():
    assert tests.compute_cell_key(*cell).hex() == key
    assert not {{"warmth", "lean"}} & cell[0].stored_fields().keys()
    assert rebuild(cell[0].stored_fields()) == cell[0]
warm = Scene(fluid="warm")
assert (warm.warmth, warm.lean) == (2.0, 0.5) and Scene().warmth is None
assert warm.as_dict()["warmth"] == 2.0 and "warmth" not in warm.stored_fields()
assert Scene(fluid="warm", warmth=3.0).with_(fluid="drained") == Scene()
for scene in (warm, Scene(fluid="warm", warmth=3.0), Scene(lean=0.7)):
    assert rebuild(scene.stored_fields()) == scene
    keys.add(tests.compute_cell_key(scene, tests.LimitCycle()))
print(len(keys))
"""


def test_a_later_part_does_not_change_the_keys_of_other_scenes():
    program = "keys = set()\n" + ADDED_PART.format(tests=str(Path(__file__).parent))
    ran = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False
    )
    assert (ran.stdout.strip(), ran.stderr) == ("3", "")


def test_a_later_slot_does_not_change_the_keys_of_other_scenes(monkeypatch):
    scene, dilatant = Scene(), Scene(fluid="dilatant")
    monkeypatch.setitem(part_registry.DEFAULTS_OMITTED_FROM_STORED_SCENES, "fluid", "drained")
    assert "fluid" not in scene.stored_fields()
    assert "fluid" not in scene.as_dict()
    assert dilatant.as_dict()["fluid"] == "dilatant"
    assert dilatant.stored_fields()["fluid"] == "dilatant"
    assert compute_cell_key(scene, LimitCycle()) != compute_cell_key(dilatant, LimitCycle())
    for each in (scene, dilatant):
        assert stored_declarations.build_scene_from_stored_fields(each.stored_fields()) == each
    assert dilatant.with_(fluid="drained") == scene
