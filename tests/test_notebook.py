"""The analysis notebook runs as it stands, on files alone."""

import re
import shutil
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient
from running import HANGS, named_results

NOTEBOOK = Path(__file__).parent.parent / "studies" / "analysis.ipynb"
STUDIES = (
    "linear_stability",
    "rigid_response",
    "rate_step_boundary",
    "rate_step_stiffness",
    "displacement_boundary",
    "bounded_slip",
    "limit_cycles",
    "stress_drop",
)


@pytest.fixture(scope="module")
def executed(tmp_path_factory, cluster):
    outputs = tmp_path_factory.mktemp("outputs")
    for name in STUDIES:
        _dataset, file = named_results(name, tmp_path_factory, client=cluster)
        shutil.copy(file, outputs)
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("MPLBACKEND", raising=False)  # the kernel chooses its own
        patch.setenv("RSFSTUDY_OUTPUTS", str(outputs))
        client = NotebookClient(notebook, timeout=HANGS, resources={"metadata": {"path": outputs}})
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


def test_results_need_nothing_of_ours_to_be_read():
    """What is imported of rsfstudy makes motions to be fitted, behind all that reads files."""
    cells = [c.source for c in nbformat.read(NOTEBOOK, as_version=4).cells if c.cell_type == "code"]
    imports = [n for n, text in enumerate(cells) if re.search("(import|from) rsfstudy", text)]
    assert len(imports) == 1
    assert not any("results(" in text for text in cells[imports[0] :])


def test_it_is_kept_without_its_output():
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells)
