"""Tests of the cost estimate of a study.

The estimate uses the times of earlier cells. Without earlier cells, the estimate is marked
as a guess.
"""

import sqlite3
from dataclasses import replace

import numpy as np
import pytest
from study_runs import SMALL_STUDY, call_main, run

from rsfstudy.cli import cost_estimates
from rsfstudy.execution.cell_plan import CellPlan
from rsfstudy.motion.accuracy import Accuracy

FILE = "small.cells.sqlite"


def words(study, output):
    return cost_estimates.describe_study_cost(CellPlan(study), output)


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """Create a journal whose cells took 10 s each."""
    output = tmp_path_factory.mktemp("kept")
    run(SMALL_STUDY, output=output, rtol=1e-4)
    with sqlite3.connect(output / FILE) as db:
        db.execute("UPDATE cells SET seconds = 10.0")
    db.close()
    return output


LOOSE = replace(SMALL_STUDY, accuracy=Accuracy(1e-4))


def test_the_same_cells_take_what_they_took(kept):
    assert f"last run took 1 min 0 s on one core ({kept / FILE})" in words(LOOSE, kept)
    assert "last run took 20 s on one core" in words(LOOSE.with_(b_over_a=[2.5]), kept)


def test_other_cells_take_as_long_as_those_that_are_there(kept):
    more = LOOSE.with_(b_over_a=[2.0, 2.2, 2.4, 2.6])
    assert f"about 1 min 20 s on one core, based on 6 cells in {kept / FILE}" in words(more, kept)


def test_without_cells_of_that_accuracy_it_is_a_guess(kept, tmp_path):
    for study, output in ((SMALL_STUDY, kept), (LOOSE, tmp_path)):
        assert "may be up to ten times longer" in words(study, output)
        assert "last" not in words(study, output)


def test_a_journal_that_cannot_be_read_is_passed_over(tmp_path):
    (tmp_path / FILE).write_text("something else")
    assert "may be up to ten times longer" in words(LOOSE, tmp_path)


def test_show_tells_it(tmp_path):
    few = ("rate_step_boundary", "--set", "b_over_a=2", "--output", tmp_path)
    assert "may be up to ten times longer" in " ".join(call_main("show", *few).stdout.split())
    assert call_main("run", *few, "--serial").returncode == 0
    assert "last run took" in " ".join(call_main("show", *few).stdout.split())


# ---- advice on the engine ------------------------------------------------------------------------
#: A study of so many cells that SciPy needs more than a minute.
MANY = SMALL_STUDY.with_(b_over_a=np.linspace(1.5, 3.0, 1500))


def test_the_compiled_engine_is_named_where_it_would_save_a_minute(tmp_path):
    assert CellPlan(MANY).estimate_evaluations_and_time()[1] > 60.0
    advice = cost_estimates.suggest_compiled_engine(CellPlan(MANY), tmp_path)
    assert advice == "--engine compiled is about 10 times faster here"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cost_estimates, "_COMPILED_SPEEDUP_BY_MEASURE", {"limit_cycle": 30})
        assert cost_estimates.suggest_compiled_engine(CellPlan(MANY), tmp_path).endswith(
            "usually faster: about 30 times with limit_cycle"
        )
    (tmp_path / FILE).touch()  # The cells of this invalid journal would all be computed again.
    assert cost_estimates.suggest_compiled_engine(CellPlan(MANY), tmp_path) == ""
