"""Tests of the instability norm of a rig, and of warnings about slow norms."""

import math
import re

import pytest

import rsfstudy
from rsfstudy import Rig, Scene, Study
from rsfstudy.cli.file_summaries import FileSummary, print_file_summary
from rsfstudy.critical_steps.triggered_instability import Triggered
from rsfstudy.errors import InvalidValue
from rsfstudy.motion.accuracy import Accuracy

SHORT = Rig(
    normal_stress="12 MPa", slip_distance="5 um", reference_velocity="1 um/s",
    stiffness="7.5 MPa/mm", period="5 ms",
)  # fmt: skip
FALLS = {
    "law": "slowness", "normal_stress": "imposed", "a": 0.006, "b_over_a": 1.5, "alpha": 0.2,
    "load_velocity_ratio": 1,
}  # fmt: skip
STUDY = Study(
    name="falls",
    title="Falls",
    rig=SHORT,
    base=SHORT.scene(**FALLS),
    axes=[SHORT.axis("normal_stress_step", ["-0.3 MPa", "-0.1 MPa"])],
    measure=Triggered(),
    accuracy=Accuracy(1e-3),
)
SLOW = (
    "the instability norm 0.0005 corresponds to a slip rate of 3.14 V_*, which is only 3.14 times"
)


def test_a_norm_may_be_a_slip_rate():
    """A norm may be given as a slip rate, because it is V T/(2 pi D_c).

    The period may belong to the rig or to the scene. A study of a rig accepts such an
    override.
    """
    expected = 10e-3 * 5e-3 / (2.0 * math.pi * 5e-6)
    scene = SHORT.scene(instability_norm="10 mm/s", **FALLS)
    assert scene.instability_norm == pytest.approx(expected, rel=1e-14)
    longer = SHORT.scene(instability_norm="10 mm/s", period="50 ms", **FALLS)
    assert longer.instability_norm == pytest.approx(10.0 * expected, rel=1e-14)
    assert SHORT.scene(instability_norm="0.01", **FALLS).instability_norm == 0.01
    other = STUDY.with_(instability_norm="10 mm/s")
    assert other.base.instability_norm == pytest.approx(expected, rel=1e-14)
    for wrong in ("10 mm", "-1 mm/s"):
        with pytest.raises(InvalidValue, match="instability_norm"):
            SHORT.scene(instability_norm=wrong, **FALLS)


def test_a_norm_near_the_load_point_is_told_once(capsys):
    """A norm close to the load velocity causes a single warning.

    The warning covers a step, or all cells of a study. A faster norm or a scene without a
    rig causes no warning.
    """
    with pytest.warns(UserWarning, match=re.escape(SLOW)) as told:
        found = rsfstudy.critical_step(
            SHORT.scene(**FALLS), "normal_stress_step", "down", rtol=1e-3
        )
    assert len(told) == 1
    in_units = SHORT.in_units(found, stress="MPa", length="um")
    # 2 pi D_c 5e-4/T
    assert float(in_units.instability_slip_rate) == pytest.approx(math.pi, rel=1e-12)
    print_file_summary(FileSummary(in_units, "falls.nc"))
    assert "3.142 um/s" in capsys.readouterr().out
    quiet = {"workers": 0, "output": None, "progress": False}
    with pytest.warns(UserWarning, match=re.escape(f"2 of 2 results: {SLOW}")) as told:
        results = rsfstudy.run(STUDY, **quiet)
    assert len(told) == 1
    assert results.unstable.values.tolist() == [1.0, 1.0]
    # The smaller step does not trigger instability.
    results = rsfstudy.run(STUDY, instability_norm="10 mm/s", **quiet)
    assert results.unstable.values.tolist() == [1.0, 0.0]
    rsfstudy.critical_step(Scene(period=1e4, b_over_a=1.5), rtol=1e-3)
