"""Tests of invalid input.

Invalid input raises an error that names the problem before any work starts. No traceback is
printed, and no output is left incomplete.
"""

import string
import warnings

import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from study_runs import SMALL_STUDY, run, run_command

import rsfstudy
from rsfstudy import Scene
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.slider.part_registry import SCENE_FIELD_NAMES
from rsfstudy.study import study_loader

#: Values that a user, a JSON file or a notebook may pass instead of a valid value.
ODD = st.one_of(
    st.none(), st.booleans(), st.integers(-5, 5), st.floats(), st.text(max_size=5), st.just([]),
    st.just({}), st.just(np.nan), st.just(np.array([1.0, 2.0])), st.just(1j), st.builds(object),
)  # fmt: skip


# ---- declarations -------------------------------------------------------------------------------
@settings(max_examples=50)
@given(st.dictionaries(st.sampled_from(SCENE_FIELD_NAMES) | st.text(max_size=6), ODD, max_size=4))
def test_a_scene_is_made_or_refused(fields):
    try:
        stiffness = Scene(**fields).stiffness
    except InvalidValue as error:
        said, stiffness = str(error), 1.0
        named = [repr(name).strip("'\"") for name in fields]
    else:
        said, named = "made", ["made"]
    assert np.isfinite(stiffness)
    assert any(name in said for name in named), said


NAMES = st.sampled_from(SCENE_FIELD_NAMES) | st.text(max_size=6)


@given(st.dictionaries(NAMES, ODD | st.lists(ODD, max_size=3), max_size=3))
def test_overrides_make_a_study_or_are_refused(overrides):
    try:
        study = SMALL_STUDY.with_(**overrides)
        scenes = list(study.scenes())
    except InvalidValue:
        return
    assert len(scenes) == study.size


# ---- the command line ---------------------------------------------------------------------------
#: Nearly valid settings, and random text.
SETTINGS = st.one_of(
    st.text(max_size=12),
    st.builds(
        "{}={}".format,
        st.sampled_from([*SCENE_FIELD_NAMES, "case", "b_over"]),
        st.text(alphabet=string.digits + ".,:-+eainf ", max_size=10),
    ),
    st.builds(
        "{}={}:{}:{}".format, st.sampled_from(SCENE_FIELD_NAMES), st.floats(), st.floats(),
        st.integers(-2, 30) | st.floats(),
    ),
)  # fmt: skip


@settings(max_examples=100, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(SETTINGS, min_size=1, max_size=2))
@example(["b_over_a=2:3:100000000000"])
@example(["b_over_a=2:3:1e400"])
@example(["b_over_a=1"])
@example(["=2"])
@example(["b_over_a="])
@example(["b_over_a=2,,3"])
def test_any_setting_is_taken_or_refused(texts):
    words = ["show", "rate_step_boundary"]
    for text in texts:
        words += ["--set", text]
    code, said = run_command(words)
    assert code in (0, 2), said
    assert code == 0 or "rror" in said


# ---- files --------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def small(tmp_path_factory):
    output = tmp_path_factory.mktemp("small")
    run(output=output)
    return output / "small.nc"


@settings(max_examples=100)
@given(data=st.data())
def test_a_damaged_file_is_refused_or_unharmed(small, tmp_path_factory, data):
    """A damaged file raises an error, or contains the same numbers.

    Bytes are changed, blanked or cut off at a random position. The numbers stay the same
    only if the bytes are unused.
    """
    content = bytearray(small.read_bytes())
    at = data.draw(st.integers(0, len(content) - 1))
    kind = data.draw(st.sampled_from(["flip", "blank", "cut"]))
    if kind == "flip":
        content[at] ^= 1 << data.draw(st.integers(0, 7))
    elif kind == "blank":
        content[at : at + 512] = bytes(len(content[at : at + 512]))
    else:
        del content[at:]
    path = tmp_path_factory.mktemp("damaged") / "damaged.nc"
    path.write_bytes(content)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # A missing digest causes a warning.
            found = rsfstudy.open(path)
    except DataError as error:
        said = str(error)
    else:
        said = "damaged.nc unharmed"
        xr.testing.assert_equal(found, xr.load_dataset(small))
    assert "damaged.nc" in said


@settings(max_examples=60)
@given(st.text(max_size=40) | st.sampled_from([
    "raise KeyError(3)", "import nothing_at_all", "study = None", "\0", "(" * 300, "def f(:",
    "from rsfstudy import *\nstudy = Study()", "import sys; sys.exit(0)", "1/0",
    "study = lambda: study", "class study: pass", "x" * 10**5, "while", "# -*- coding: nothing -*-",
]))  # fmt: skip
def test_any_study_file_is_taken_or_refused(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("file") / "mine.py"
    path.write_text(text, errors="surrogatepass")
    with pytest.raises(InvalidValue, match="mine"):
        study_loader.load_study(str(path))


# ---- where results go ---------------------------------------------------------------------------
@pytest.mark.parametrize("output", ["/dev/null/results", "/proc/results"])
def test_an_output_that_cannot_be_written(output, monkeypatch):
    """The error is raised before any cell is computed."""
    monkeypatch.setattr("rsfstudy.execution.cell_computation.compute_cell", None)
    with pytest.raises(DataError, match=f"cannot use {output}.*Choose another --output"):
        run(output=output)
