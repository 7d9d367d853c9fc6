"""Tests of the compiled engine."""

import ctypes
import itertools
import math
import os
import subprocess
import sys
import types
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from numba.core.bytecode import FunctionIdentity
from study_runs import COMPILED_ONLY_STUDIES, SMALL_STUDY, reduced_study, run

from rsfstudy import Scene, critical_step, limit_cycle, simulate
from rsfstudy.errors import DataError, IncompleteWarning, InvalidValue
from rsfstudy.execution.cell_plan import CellPlan
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.compiled import compile_cache, numba_backend
from rsfstudy.motion.engines import COMPILED, ENGINE_NAMES, compilation_log
from rsfstudy.slider.equations import build_equations_between_ruptures
from rsfstudy.slider.laws import Law
from rsfstudy.slider.laws.slip import SlipLaw
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.status import Status
from rsfstudy.study import study_loader

CYCLE = {"stiffness_ratio": 0.8, "load_velocity_ratio": 2.0, "inertia": True}


# ---- same results; see also the frozen events, and test_extensions for user-defined parts
@pytest.mark.parametrize("rows", [8, 9, 10, 11, 12, 13])
def test_a_recording_is_the_same_however_few_rows_a_call_may_fill(rows, monkeypatch):
    """The recording does not depend on the number of rows per call.

    The regime changes in the middle of a table and at its last rows.
    """
    scene, accuracy = Scene(**CYCLE), Accuracy(rtol=1e-3, engine=COMPILED)
    whole = LimitCycle(phases=50)(scene, accuracy)
    monkeypatch.setattr("rsfstudy.motion.motion_driver._RECORDING_ROWS", rows)
    pieces = LimitCycle(phases=50)(scene, accuracy)
    assert np.array_equal(whole.values["shear_stress"], pieces.values["shear_stress"])
    assert whole.values["recurrence_interval"] == pieces.values["recurrence_interval"]


def test_hard_cases_come_out():
    """All hard cases agree with their reference values."""
    study = study_loader.load_study("hard_cases")
    ended = run(study, engine=COMPILED)
    assert (ended["status"] == int(Status.OK)).all()


def test_one_scene_calls_take_an_engine():
    values = [
        float(critical_step(Scene(), engine=by)["critical_velocity_ratio"]) for by in ENGINE_NAMES
    ]
    assert values[1:] == pytest.approx([values[0]] * 2, rel=1e-6)
    ours = limit_cycle(Scene(**CYCLE), rtol=1e-6, engine=COMPILED)
    assert ours.attrs["status"] == "ok"
    assert ours.attrs["engine"] == COMPILED


# ---- what cannot be ------------------------------------------------------------------------------
TABLE = {"part": 0.5}


def tabulated(log_slip_rate, state, p):
    return -(state + p[LAW] * log_slip_rate) * TABLE["part"]


@dataclass(frozen=True, kw_only=True)
class Tabulated(Law):
    name = "tabulated"
    evolution = staticmethod(tabulated)


def test_a_part_that_cannot_be_compiled_is_named_with_the_line():
    line = tabulated.__code__.co_firstlineno + 1
    with pytest.raises(InvalidValue, match=rf"the part .*tabulated.*test_compiled.py, line {line}"):
        numba_backend.compile_equations_of_scene(Scene(law=Tabulated), include_time_equation=True)
    assert (
        simulate(Scene(law=Tabulated, stiffness=0.01, hold_time=1.0), duration=1.0).attrs["status"]
        == "ok"
    )


def guarded(log_slip_rate, state, p):
    if log_slip_rate > 1.0:
        raise ValueError("too fast for these experiments")
    return -(state + p[LAW] * log_slip_rate)


@dataclass(frozen=True, kw_only=True)
class Guarded(Law):
    name = "guarded"
    evolution = staticmethod(guarded)


def test_a_part_that_raises_is_refused():
    """A law that raises an error is rejected.

    Compiled functions cannot raise, so the motion would continue with wrong values.
    """
    scene = Scene(law=Guarded, stiffness_ratio=1.5, load_velocity_ratio=20.0)
    with pytest.raises(ValueError, match="too fast"):
        simulate(scene, duration=10.0)
    with pytest.raises(InvalidValue, match="guarded, .*it raises an error"):
        simulate(scene, duration=10.0, engine=COMPILED)


def ending(log_slip_rate, state, p):
    return math.nan if log_slip_rate > 1.0 else -(state + p[LAW] * log_slip_rate)


@dataclass(frozen=True, kw_only=True)
class Ending(Law):
    name = "ending"
    evolution = staticmethod(ending)


@pytest.mark.parametrize("by", ENGINE_NAMES)
def test_a_rate_that_is_no_number_ends_the_motion(by):
    scene = Scene(law=Ending, stiffness_ratio=1.5, load_velocity_ratio=20.0)
    with pytest.warns(IncompleteWarning, match="the motion ends after"):
        ended = simulate(scene, duration=10.0, budget=5_000, engine=by)
    assert ended.attrs["status"] in ("integration_failed", "work_budget_spent")
    assert float(ended["log10_slip_rate"].max()) <= 1.0 / math.log(10.0)


# ---- files and time ------------------------------------------------------------------------------
def test_a_file_says_which_engine_and_cells_are_not_mixed(tmp_path):
    small = replace(SMALL_STUDY, axes=SMALL_STUDY.axes[:1])
    ran = run(small, engine=COMPILED, output=tmp_path)
    assert '"engine": "compiled"' in ran.attrs["provenance"]
    assert '"numba"' in ran.attrs["provenance"]
    with pytest.raises(DataError, match="engine"):
        run(small, output=tmp_path)


# Waves are compared with the motion without waves, which has different equations.
@pytest.mark.parametrize(
    "name", [name for name in COMPILED_ONLY_STUDIES if name != "wave_triggering"]
)
def test_what_cells_need_is_compiled_before_them(name, monkeypatch):
    """The equations of all cells are compiled before the first cell.

    The attribute ``needs_time`` of the measure determines these equations.
    """
    wanted, addresses = list[tuple[str, ...]](), numba_backend.get_compiled_function_addresses

    def asked(equations):
        wanted.append((equations.regime_name, *equations.unknown_names))
        return addresses(equations)

    study = reduced_study(name)
    scene = CellPlan(study).example_scenes[0]
    monkeypatch.setattr(numba_backend, "get_compiled_function_addresses", asked)
    for clock in study.measure.needs_time:
        numba_backend.compile_equations_of_scene(scene, include_time_equation=clock)
    prepared = set(wanted)
    wanted.clear()
    study.measure(scene, study.accuracy)
    assert set(wanted)
    assert set(wanted) <= prepared


# ---- the cache -----------------------------------------------------------------------------------
known = types.ModuleType("known")
known.NUMBER = 1.0


def doubled(y, rates, p, result):
    result[0] = 2.0 * y[0]


def tripled(y, rates, p, result):
    result[0] = 3.0 * y[0]


@pytest.fixture
def empty_cache(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return compile_cache.get_compile_cache_folder()


def compiled_programs(function=doubled) -> int:
    """Return the number of programs compiled to call a function by address."""
    before = compilation_log.compiled_program_count
    (address,) = compile_cache.compile_cfuncs_and_get_addresses([function])
    assert address
    return compilation_log.compiled_program_count - before


def test_other_processes_find_equations_again(tmp_path):
    """Another process loads the compiled equations from the cache.

    The equations are closures, which Numba's own cache would compile again.
    """
    asks = (
        "from rsfstudy import Accuracy, Integrator, Scene\n"
        "from rsfstudy.critical_steps.critical_path import CriticalPath\n"
        "from rsfstudy.motion.compiled.numba_backend import get_compiled_function_addresses\n"
        "from rsfstudy.motion.engines import compilation_log\n"
        "from rsfstudy.slider.equations import build_equations_between_ruptures\n"
        "scene = Scene(normal_stress='constant')\n"
        "equations = build_equations_between_ruptures(scene, with_time=False)\n"
        "get_compiled_function_addresses(equations)\n"
        "CriticalPath.from_scene(scene, Integrator(Accuracy(engine='compiled')))\n"
        "print(compilation_log.compiled_program_count)\n"
    )
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path)}
    programs, written = list[int](), list[set[str]]()
    for _ in range(2):
        said = subprocess.check_output([sys.executable, "-c", asks], env=environment, text=True)
        programs.append(int(said))
        written.append({str(file) for file in tmp_path.rglob("*.nb?")})
    assert programs == [2, 0]
    assert written[0] == written[1]


def test_what_is_compiled_is_found_again(empty_cache):
    """The cache is reused, and its folders are private despite the umask."""
    before = os.umask(0o002)
    try:
        assert [compiled_programs() for _ in range(3)] == [1, 0, 0]
    finally:
        os.umask(before)
    assert compiled_programs(tripled) == 1
    assert len(list(empty_cache.iterdir())) == 2


@pytest.mark.parametrize("kind", ["*.nbc", "*.nbi"])
def test_a_cache_that_was_cut_short_costs_time_only(kind, empty_cache):
    compiled_programs()
    (file,) = empty_cache.rglob(kind)
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    assert [compiled_programs() for _ in range(2)] == [1, 0]


def test_a_cache_that_cannot_be_written_costs_time_only(empty_cache):
    empty_cache.parent.write_text("no folder")
    assert [compiled_programs() for _ in range(2)] == [1, 1]


def files_in(folder: Path) -> list[tuple[str, bytes]]:
    return sorted((str(f), f.read_bytes()) for f in folder.rglob("*") if f.is_file())


@pytest.mark.parametrize("mode", [0o770, 0o707])
@pytest.mark.parametrize("place", [".", "compiled", "compiled/*"])
def test_folders_that_others_may_write_to_are_left_alone(place, mode, empty_cache, caplog):
    compiled_programs()
    (folder,) = [empty_cache.parent] if place == "." else empty_cache.parent.glob(place)
    folder.chmod(mode)
    before = files_in(empty_cache)
    assert [compiled_programs() for _ in range(2)] == [1, 1]
    assert files_in(empty_cache) == before
    (said,) = caplog.messages
    assert f"{folder} is not private to the current user" in said


def test_folders_of_others_are_left_alone(empty_cache, monkeypatch):
    compiled_programs()
    before = files_in(empty_cache)
    me = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: me + 1)
    assert [compiled_programs(f) for f in (doubled, tripled)] == [1, 1]
    assert files_in(empty_cache) == before


def test_a_user_without_a_home_is_served(monkeypatch):
    """Compilation works for a user without an entry in passwd."""
    for name in ("HOME", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("pwd.getpwuid", {}.__getitem__)
    assert [compiled_programs() for _ in range(2)] == [1, 1]


def test_laws_are_told_apart_whatever_process_compiled_them(empty_cache, monkeypatch):
    """Compiled laws from different processes are not confused.

    The functions of the laws have equal names, and each process numbers its compiled
    functions from the same start. The test resets the numbers and then loads both laws.
    """
    function, state = ctypes.CFUNCTYPE(None, *[ctypes.POINTER(ctypes.c_double)] * 4), (0.01, 0.02)
    for law in ("perrin_rice_zheng", "slip", "perrin_rice_zheng", "slip"):
        monkeypatch.setattr(FunctionIdentity, "_unique_ids", itertools.count(10**7))
        compile_cache._jit_compile_callee_cached.cache_clear()
        monkeypatch.setattr(numba_backend, "_COMPILED_FUNCTION_ADDRESS_CACHE", {})
        equations = build_equations_between_ruptures(
            Scene(law=law, normal_stress="constant"), with_time=False
        )
        y, p = (
            (ctypes.c_double * 2)(*state),
            (ctypes.c_double * len(equations.parameters))(*equations.parameters),
        )
        result = (ctypes.c_double * 2)()
        function(numba_backend.get_compiled_function_addresses(equations)[0])(y, y, p, result)
        assert list(result) == pytest.approx(list(equations.evaluate_rates(state)), rel=1e-12)


def test_a_cache_of_other_code_is_never_used(monkeypatch):
    """The digest changes with any change of a function or its constants."""
    scene = Scene(law=SlipLaw)
    rate = build_equations_between_ruptures(scene, with_time=False).rate_function
    before = compile_cache.compute_code_digest(None, rate)
    assert compile_cache.compute_code_digest(None, rate) == before
    cells = scene.friction_law_functions.strength.__closure__
    effect = next(
        c.cell_contents
        for c in cells
        if c.cell_contents.__name__ == "compute_linker_dieterich_state_decrease"
    )
    monkeypatch.setitem(effect.__globals__, "NORMAL_STRESS", 3)
    assert compile_cache.compute_code_digest(None, rate) != before
    assert compile_cache.compute_code_digest(None, doubled) != compile_cache.compute_code_digest(
        None, tripled
    )
    before = compile_cache.compute_code_digest(None, doubled)
    assert compile_cache.compute_code_digest(int, doubled) != before
    monkeypatch.setitem(compile_cache._COMPILER_OPTIONS, "fastmath", {"nsz"})
    assert compile_cache.compute_code_digest(None, doubled) != before


def by_module(y, rates, p, result):
    result[0] = known.NUMBER * y[0]


def test_a_number_of_another_module_counts_too(monkeypatch):
    monkeypatch.setattr(known, "NUMBER", 2.0)
    before = compile_cache.compute_code_digest(None, by_module)
    monkeypatch.setattr(known, "NUMBER", 3.0)
    assert compile_cache.compute_code_digest(None, by_module) != before
