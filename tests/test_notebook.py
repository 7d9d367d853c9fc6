"""Tests of the notebooks, which must run and contain their outputs."""

import re
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient
from study_runs import HANG_TIMEOUT

HERE = Path(__file__).parent.parent / "studies"
NOTEBOOK, FITTING = HERE / "analysis.ipynb", HERE / "fitting.ipynb"

#: Statements of the notebook about its numbers.
CONCLUDED = """
assert errors["ratio"].loc[["a", "b", "slip_distance", "trend1"]].between(2.0, 2.5).all()
assert 1.3 < errors["ratio"]["mu_star"] < 1.7  # the noise is quieter before the step
assert errors["ratio"].loc[["a", "b", "slip_distance"]].between(2.15, 2.35).all()
assert abs(rows - 2863) < 10 and abs(n_eff - 643) < 20
ratios = [float(fixed[f"{n}_stderr"][0] / fixed_white[f"{n}_stderr"][0]) for n in FREE[:3]]
assert 4.0 < min(ratios) and max(ratios) < 6.5
assert float(fixed.a[0]) < 0.75 * float(honest.a)
assert float(fixed.aic[0] - honest.aic) > 100
assert abs(float(fit.aic[0] - fit.aic[1])) < 10
slip, slowness = fit.slip_distance.values
assert 1.25 < slip / slowness < 1.45
assert slip - slowness > float(fit.slip_distance_stderr.sum())
assert (-2.0 < fit.a_minus_b / fit.a_minus_b_stderr).all() and (fit.a_minus_b < 0).all()
assert float(naive.a_minus_b) < -3.0 * usual
assert 2.0 * float(sampled.std()) < alone
assert abs(float(other.slip_distance[0]) - slip) < float(other.slip_distance_stderr[0])
assert (fit.status == 0).all()
"""


@pytest.fixture(scope="module")
def executed(tmp_path_factory):
    outputs = tmp_path_factory.mktemp("outputs")
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("MPLBACKEND", raising=False)  # The kernel selects its own backend.
        patch.setenv("RSFSTUDY_OUTPUTS", str(outputs))
        client = NotebookClient(
            notebook, timeout=HANG_TIMEOUT, resources={"metadata": {"path": outputs}}
        )
        return client.execute()


def test_it_makes_the_figures_of_the_paper(executed):
    pictures = [
        output
        for cell in executed.cells
        for output in cell.get("outputs", [])
        if "image/png" in output.get("data", {})
    ]
    assert len(pictures) >= 8


def test_no_cell_complains(executed):
    for cell in executed.cells:
        for output in cell.get("outputs", []):
            assert output.get("name") != "stderr", output["text"]


def test_fits_tell_what_their_notebook_says():
    """The results agree with the text of the notebook.

    The notebook runs in the directory of studies, as for a user.
    """
    notebook = nbformat.read(FITTING, as_version=4)
    assert notebook.cells[-1].source.startswith("mine = ")
    notebook.cells.append(nbformat.v4.new_code_cell(CONCLUDED))
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("MPLBACKEND", raising=False)
        client = NotebookClient(
            notebook, timeout=HANG_TIMEOUT, resources={"metadata": {"path": HERE}}
        )
        cells = client.execute().cells
    outputs = [output for cell in cells for output in cell.get("outputs", [])]
    assert sum("image/png" in output.get("data", {}) for output in outputs) == 2
    assert not any(output.get("name") == "stderr" for output in outputs)


def test_the_record_has_its_licence_beside_it():
    assert (HERE / "records" / "LICENSE").read_text().startswith("MIT License")


def test_results_need_nothing_of_ours_to_be_read():
    """Only two cells of the notebook import rsfstudy."""
    cells = [c.source for c in nbformat.read(NOTEBOOK, as_version=4).cells if c.cell_type == "code"]
    using = [text for text in cells if "rsfstudy." in text]
    assert len(using) == 2
    assert not any("results(" in text for text in using)


@pytest.mark.parametrize("path", [NOTEBOOK, FITTING], ids=lambda path: path.stem)
def test_it_is_stored_with_its_outputs(path):
    """The stored notebook is small and contains no errors or local paths."""
    cells = [c for c in nbformat.read(path, as_version=4).cells if c.cell_type == "code"]
    outputs = [output for cell in cells for output in cell.outputs]
    assert sum("image/png" in output.get("data", {}) for output in outputs) >= 2
    assert not any(output.get("name") == "stderr" for output in outputs)
    assert all(cell.execution_count == n + 1 for n, cell in enumerate(cells))
    assert path.stat().st_size < 500 * 1024
    assert not re.search(r"/(home|tmp|Users|root)/", path.read_text())
