"""Helper functions for pages of the explorer."""

from pathlib import Path

#: Maximum time in ms that a test waits for a change of the page.
PATIENCE = 60_000
#: Record with steps at 100 s and 140 s.
STEP = str(Path(__file__).parents[2] / "studies" / "pages" / "step.csv")
_DOWNLOADS = ("Figure (PDF)", "Figure (SVG)", "Figure (PNG)", "Table (CSV)", "Data (NetCDF)")


def text_of(page, label):
    """Return the text of a box in the tab "Code"."""
    return page.get_by_label(label, exact=True).input_value()


def download_files(page, directory):
    """Download the files of a page, check the images, and return the table and the dataset."""
    page.get_by_text("Download", exact=True).click()
    files = []
    for label in _DOWNLOADS:
        with page.expect_download() as started:
            page.get_by_text(label, exact=True).click()
        files.append(directory / started.value.suggested_filename)
        started.value.save_as(files[-1])
    assert [file.suffix for file in files] == [".pdf", ".svg", ".png", ".csv", ".nc"]
    assert len({file.stem for file in files}) == 1
    assert files[0].read_bytes().startswith(b"%PDF-")
    assert "<svg" in files[1].read_text()
    assert files[2].read_bytes().startswith(b"\x89PNG")
    return files[3:]
