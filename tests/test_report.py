"""Tests of the HTML report of a directory.

The report is self-contained and works on screens of any size.
"""

import base64
import json
import os
import re
import shutil
import subprocess
from html.parser import HTMLParser
from urllib.parse import unquote

import pytest
import xarray as xr
from study_runs import HANG_TIMEOUT, call_main, example_claim, run

import rsfstudy
from rsfstudy import Axis, Scene, Study, plots
from rsfstudy.errors import DataError, InvalidValue, NoResultWarning
from rsfstudy.plots import _figure_size
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.status import Status
from rsfstudy.storage import dataset_files

#: The report in frames of a given width in CSS pixels, for a phone and for a desktop.
FRAME = '<iframe src="{}" style="width:{}px;height:900px;border:0"></iframe>'
WIDTHS = (390, 1280)
#: A script that returns the width of each frame, the width of its content, and the widths of its
#: images.
LOOK = """<script>onload = () => {console.log("looked"); document.title = JSON.stringify(
Array.from(document.querySelectorAll("iframe"), ({contentWindow: w, contentDocument: d}) =>
    [w.innerWidth, d.scrollingElement.scrollWidth, Array.from(d.images, i => i.naturalWidth)]))}
</script>"""
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
#: Elements without an end tag.
VOID = {"meta", "link", "img", "br"}
EVIL = "</p><script>alert(1)</script> & \x1b[31m"


class Page(HTMLParser):
    """HTML parser that asserts that elements are nested correctly."""

    def __init__(self, text):
        super().__init__()
        self.open, self.found, self.texts = [], [], []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)

    def all(self, tag):
        return [about for name, about in self.found if name == tag]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Create a directory with files of all kinds, and write the report."""
    place = tmp_path_factory.mktemp("results")
    claim = example_claim(statement=f"k {EVIL}", variable="critical_stiffness", tolerance=0.5,
                    relation="below", where={"law": "slip", "b_over_a": 2.0})  # fmt: skip
    axes = [Axis("law", ["slip", "slowness"]), Axis("b_over_a", [1.5, 2.0, 3.0])]
    study = Study(name="fine", title=f"Fine {EVIL}", base=Scene(), axes=axes,
                  measure=LinearStability(), claims=[claim])  # fmt: skip
    fine = run(study, output=place)
    other = fine.copy(deep=True)
    other["status"][0, 1], other["message"][0, 1] = int(Status.INTEGRATION_FAILED), EVIL
    other["critical_stiffness"][0, 1] = 7.0  # This value changes the verdict of the claim.
    dataset_files.write_dataset(other, place / "failed here.nc")
    motion = rsfstudy.simulate(
        Scene(load_velocity_ratio=2.0, normal_stress="constant"), duration=0.1
    )
    motion.to_netcdf(place / "motion.nc")
    (place / "cut.nc").write_bytes((place / "fine.nc").read_bytes()[:2000])
    xr.Dataset({"x": 1.0}).to_netcdf(place / "foreign.nc")
    run(study.with_(law="slip"), output=place / "zarr", format="zarr")
    shutil.move(place / "zarr" / "fine.zarr", place / "pieces.zarr")
    shutil.rmtree(place / "zarr")
    shown = rsfstudy.plot(fine)
    shown.savefig(place / "fine.png", dpi=50)
    ran = call_main("report", place)
    return place, ran, (place / "report.html").read_text()


RESULTS = ("fine.nc", "failed here.nc", "motion.nc", "cut.nc", "foreign.nc", "pieces.zarr")


def test_it_is_well_formed_and_has_a_section_for_every_file(written):
    place, ran, text = written
    page = Page(text)
    sections = {about["id"] for about in page.all("section")}
    assert len(sections) == len(RESULTS) == sum(text.count(f">{name}</a>") for name in RESULTS)
    linked = [about["href"] for about in page.all("a")]
    assert {f"#{name}" for name in sections} <= set(linked)
    for link in linked:
        assert link.removeprefix("#") in sections or (place / unquote(link)).exists(), link
    assert f"wrote {place / 'report.html'}" in ran.stdout


def test_it_needs_nothing_else(written):
    """The report contains its figures and refers to no other resources."""
    place, _ran, text = written
    page = Page(text)
    for _tag, about in page.found:
        for name in ("src", "srcset", "data", "action", "poster"):
            assert about.get(name, "data:").startswith("data:")
    assert [about["href"] for about in page.all("link")] == ["data:,"]
    assert not {"script", "iframe", "object"} & {tag for tag, _about in page.found}
    assert "url(" not in text
    assert "@import" not in text
    images = [about["src"].removeprefix("data:image/png;base64,") for about in page.all("img")]
    assert len(images) == 4  # Figures of three studies and a motion.
    shown = [base64.b64decode(image) for image in images]
    assert all(image.startswith(b"\x89PNG") for image in shown)
    # The existing figure is used, because it is newer than the results.
    assert (place / "fine.png").read_bytes() in shown


def test_it_tells_verdicts_failures_and_what_cannot_be_read(written):
    place, ran, text = written
    said = " ".join(" ".join(Page(text).texts).split())
    assert "1 reproduced" in said
    assert "1 integration_failed, verdict of C1 changed" in said
    assert "differs, expected reproduced" in said
    assert "rsfstudy rerun 'failed here.nc' --cell law=slip --cell b_over_a=2.0" in said
    assert r"</p><script>alert(1)</script> & \x1b[31m" in said  # Markup in messages is escaped.
    critical = rsfstudy.open(place / "fine.nc")["critical_stiffness"].sel(law="slip", b_over_a=1.5)
    assert f" {float(critical):.8g} " in said
    assert "< 1" in said
    assert ran.returncode == 1
    assert said.count("cannot be read") >= 4
    for name in ("cut.nc", "foreign.nc"):
        assert f"{name} cannot be read (see the page for the reason)" in ran.stdout


def test_python_names_the_page_and_refuses_what_is_none(tmp_path):
    with pytest.raises(DataError, match="contains no results"):
        rsfstudy.report(tmp_path)
    motion = rsfstudy.simulate(
        Scene(load_velocity_ratio=2.0, normal_stress="constant"), duration=0.1
    )
    (tmp_path / "in").mkdir()
    motion.to_netcdf(tmp_path / "in" / "one.nc")
    page = rsfstudy.report(tmp_path / "in", tmp_path / "all.html")
    assert page == tmp_path / "all.html"
    assert 'href="in/one.nc"' in page.read_text()
    with pytest.raises(InvalidValue, match=r"suffix \.html"):
        rsfstudy.report(tmp_path / "in", tmp_path / "all.txt")
    assert rsfstudy.report(tmp_path / "in", page) == page  # A report can be overwritten.
    page.write_text("<!DOCTYPE html><p>mine</p>")
    with pytest.raises(InvalidValue, match="already exists and is not a report"):
        rsfstudy.report(tmp_path / "in", page)
    assert "mine" in page.read_text()
    with pytest.raises(InvalidValue, match="does not exist or is not a directory"):
        rsfstudy.report(tmp_path / "nowhere")


def test_it_tells_answers_that_are_none_and_draws_what_is_in_other_units(tmp_path):
    """The report shows statuses, cycles, and results in other units.

    Figures have their printed width, so the text has the same size in all figures.
    """
    axes = [Axis("b_over_a", [1.5, 2.0, 3.0])]
    study = Study(name="one", title="One", base=Scene(), axes=axes, measure=LinearStability())
    found = run(study)
    found.rsf.to_si(normal_stress=5e6, slip_distance=1e-5).to_netcdf(tmp_path / "si.nc")
    dataset_files.write_dataset(
        found.assign(status=found.status * 0 + Status.LOCKED), tmp_path / "locked.nc"
    )
    scene = Scene(law="slowness", inertia=True, stiffness_ratio=0.8, load_velocity_ratio=2.0)
    cycle = rsfstudy.limit_cycle(scene, rtol=1e-3, engine="compiled")
    cycle.to_netcdf(tmp_path / "cycle.nc")
    with pytest.warns(NoResultWarning):
        none = rsfstudy.limit_cycle(scene.with_(stiffness_ratio=1.5), engine="compiled")
    none.to_netcdf(tmp_path / "none.nc")
    text = rsfstudy.report(tmp_path).read_text()
    assert ' yellow">3 locked<' in text
    assert ' yellow">no limit cycle<' in text
    assert (
        "no figure: the dataset contains no motion, so there is nothing to draw. no_limit_cycle: "
        in text
    )
    with plots.style_context():
        wide = f"--inches: {_figure_size.compute_figure_size_in_inches(2, 1)[0]:.3g}"
    assert [about["style"] for about in Page(text).all("img")] == [wide] * 3


def test_a_browser_shows_it_on_a_phone_and_on_a_desk(written, tmp_path):
    """A browser shows the report without errors on small and large screens.

    No element is wider than the screen, and every figure is loaded.
    """
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        missing = f"the report was NOT opened in a browser: none of {BROWSERS} is installed"
        if os.environ.get("CI"):
            pytest.fail(missing)
        pytest.skip(missing)
    page, frames = (written[0] / "report.html").as_uri(), tmp_path / "frames.html"
    frames.write_text("".join(FRAME.format(page, width) for width in WIDTHS) + LOOK)
    words = ["--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files"]
    words += ["--enable-logging=stderr", f"--user-data-dir={tmp_path}", "--dump-dom"]
    ran = subprocess.run(
        [browser, *words, frames.as_uri()],
        env=os.environ | {"HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
        timeout=HANG_TIMEOUT,
    )
    # The script logs one line, and errors of the page would add lines.
    (said,) = re.findall("CONSOLE.*", ran.stderr)
    assert "looked" in said
    looks = json.loads(re.search("<title>(.*?)</title>", ran.stdout)[1])
    assert [inner for inner, _scroll, _images in looks] == [*WIDTHS]
    for inner, scroll, images in looks:
        assert scroll <= inner
        assert len(images) == 4
        assert min(images) > 0
