"""Tests of healing and stiffness that are measured on records and motions."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import synthetic_records as synthetic
import xarray as xr

import rsfstudy
from rsfstudy import Accuracy, Scene
from rsfstudy.api import record_fitting
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.fitting import Record
from rsfstudy.fitting.hold_table import fit_healing_rate
from rsfstudy.measures import Healing
from rsfstudy.reporting import build_summary_tables_and_sentences

sys.path.insert(0, str(Path(__file__).parent / "benchmarks"))
import holds_and_stiffness as benchmark

sys.path.pop(0)

TIME = np.arange(0.0, 120.0, 0.05)


def peaked_record(
    noise: float = 0.0, trend: float = 0.0, peak: float = 0.03, seed: int = 0
) -> Record:
    """Return a record with a hold from 40 to 60 s and a parabolic peak at 63 s."""
    moved = np.interp(TIME, [0.0, 40.0, 60.0, 120.0], [0.0, 400.0, 400.0, 1000.0])
    friction = np.interp(TIME, [0.0, 40.0, 60.0, 62.0, 64.0, 68.0], [0.6, 0.6, 0.58, 0.6, 0.6, 0.6])
    top = np.abs(TIME - 63.0) < 1.0
    friction[top] += peak * (1.0 - (TIME[top] - 63.0) ** 2)
    friction += trend * moved + noise * np.random.default_rng(seed).standard_normal(len(TIME))
    arrays = {"time": TIME, "displacement": moved, "friction": friction}
    return rsfstudy.read_record(arrays, name="peaked")


@pytest.mark.parametrize("seed", [0, 3, 4])
def test_healing_of_an_independent_integration(seed: int) -> None:
    healing, rate, relative = benchmark.deviations_of_holds(seed)
    assert np.abs(healing).max() < 4.0
    assert abs(rate) < 3.0
    assert relative < 0.1


@pytest.mark.parametrize("seed", [0, 7, 14])
def test_stiffness_of_an_independent_integration(seed: int) -> None:
    deviation, relative = benchmark.deviation_of_stiffness(seed)
    assert abs(deviation) < 3.0
    assert relative < 0.05


@pytest.mark.parametrize("law", ["slip", "slowness"])
def test_records_and_motions_agree_with_the_measure(law: str) -> None:
    scene = Scene(law=law, normal_stress="constant", hold_time=1000.0, stiffness_ratio=10.0)
    exact = Healing()(scene, Accuracy()).values
    motion = rsfstudy.simulate(scene, duration=1100.0)
    of_motion = rsfstudy.healing(motion).isel(hold=0)
    time, moved, friction = (
        motion[n].values for n in ("time", "load_point_displacement", "friction_coefficient")
    )
    rows = np.append(True, np.diff(time) > 0.0)
    before = np.arange(-50.0, 0.0, 0.25)
    arrays = {
        "time": np.concatenate([before, time[rows]]),
        "displacement": np.concatenate([before, moved[rows]]),
        "friction": np.concatenate([np.full(len(before), friction[0]), friction[rows]]),
    }
    record = rsfstudy.read_record(arrays).with_steps([(0, 0, 1, 0), (1000, 1000, 0, 1)])
    of_record = record.holds().isel(hold=0)
    for name in ("healing", "relaxation", "peak_displacement"):
        assert float(of_motion[name]) == pytest.approx(exact[name], rel=1e-6)
        assert float(of_record[name]) == pytest.approx(exact[name], rel=1e-4)
    assert float(of_motion["duration"]) == pytest.approx(1000.0)


def test_several_holds_of_a_motion_have_the_units_of_the_motion() -> None:
    loading = rsfstudy.protocol(
        [
            {"velocity": velocity, "duration": duration}
            for velocity, duration in ((0, 100), (1, 50), (0, 1000), (1, 50))
        ]
    )
    scene = Scene(normal_stress="constant", loading=loading, stiffness_ratio=10.0)
    motion = rsfstudy.simulate(scene, duration=1200.0)
    table = motion.rsf.holds()
    np.testing.assert_allclose(table["duration"], [100.0, 1000.0])
    assert table["duration"].attrs["scale"] == "D_c/V_*"
    slope = float(table["healing"][1] - table["healing"][0])
    assert float(table["healing_rate"]) == pytest.approx(slope)
    converted = motion.rsf.to_si(normal_stress="5 MPa", slip_distance="10 um").rsf.holds()
    assert converted["duration"].attrs["units"] == "s"
    ratio = (converted["duration"] / table["duration"]).values
    np.testing.assert_allclose(ratio, 1.0 / scene.reference_rate)
    np.testing.assert_allclose(converted["healing"], table["healing"])


def test_peak_is_not_biased_by_noise() -> None:
    highest, found = [], []
    for seed in range(25):
        record = peaked_record(noise=1e-3, seed=seed)
        table = record.holds().isel(hold=0)
        highest.append(record.columns["friction"].max() - 0.63)
        found.append(float((table["peak_friction"] - 0.63) / table["peak_friction_stderr"]))
    # The mean of 25 deviations has a standard error of 0.2.
    assert np.mean(highest) > 7e-4
    assert abs(np.mean(found)) < 0.7
    assert 0.5 < np.std(found) < 1.6


def test_trend_is_subtracted() -> None:
    plain = peaked_record(noise=1e-4).holds().isel(hold=0)
    steep = peaked_record(noise=1e-4, trend=2e-5).holds().isel(hold=0)
    assert float(steep["trend"]) == pytest.approx(2e-5, rel=0.05)
    for name in ("healing", "relaxation"):
        difference = abs(float(steep[name] - plain[name]))
        assert difference < 0.1 * float(plain[f"{name}_stderr"])
        assert float(plain[name]) == pytest.approx(0.03 if name == "healing" else -0.02, abs=5e-4)


def test_friction_without_a_peak_has_no_healing() -> None:
    table = peaked_record(noise=1e-4, peak=0.0).holds().isel(hold=0)
    assert np.isnan(table["healing"])
    assert np.isnan(table["healing_rate"])
    assert float(table["relaxation"]) == pytest.approx(-0.02, abs=5e-4)


def test_healing_rate_is_the_slope_of_a_line() -> None:
    durations = np.array([10.0, 100.0, 1000.0])
    rate, stderr, intercept = fit_healing_rate(
        durations, 0.01 + 0.02 * np.log10(durations), 1e-6 * np.eye(3)
    )
    assert (rate, intercept) == pytest.approx((0.02, 0.01))
    assert stderr == pytest.approx(1e-3 / np.sqrt(2.0))
    # The residuals of the line are -1, 2 and -1 in units of 1/300.
    scattered = fit_healing_rate(durations, np.array([0.03, 0.06, 0.07]), 1e-12 * np.eye(3))
    assert scattered[:2] == pytest.approx((0.02, np.sqrt(6.0 / 2.0) / 300.0))
    assert np.isnan(fit_healing_rate(durations[:1], np.array([0.03]), np.eye(1))[0])


def test_unloading_is_no_hold_and_has_the_stiffness() -> None:
    """The fault is locked exactly, so the slope is the stiffness."""
    time = np.arange(0.0, 90.0, 0.05)
    moved = np.interp(time, [0, 30, 36, 60, 90], [0, 300, 240, 240, 540])
    locked = 0.6 + 2e-3 * np.minimum(moved - 300.0, 0.0) * (time > 30.0)
    noise = 2e-4 * np.random.default_rng(1).standard_normal(len(time))
    stress = np.full(len(time), 5e6)
    columns = {"time": time, "displacement": moved, "friction": locked + noise}
    record = Record({**columns, "normal_stress": stress})
    assert record.holds().sizes["hold"] == 0
    with pytest.raises(InvalidValue, match="has no hold of the load point"):
        rsfstudy.healing(record)
    table = record.stiffness()
    assert table["kind"].values.tolist() == ["unloading", "reloading"]
    assert float(table["machine_stiffness"]) == pytest.approx(1e4, rel=5e-3)
    assert float(table["stiffness"]) == pytest.approx(2e-3, rel=5e-3)
    assert Record(columns).stiffness()["stiffness"] == table["stiffness"]


def test_fit_counts_the_error_of_a_measured_stiffness(monkeypatch: pytest.MonkeyPatch) -> None:
    record = synthetic.synthetic_record()
    options = {**synthetic.FIT_OPTIONS, "laws": ["slowness"], "noise": "ar1"}
    spread = 0.03
    monkeypatch.setattr(
        record_fitting, "_measure_stiffness_in_records", lambda _records: (3e-3, 0.0, spread)
    )
    measured = rsfstudy.fit(record, **options | {"stiffness": "from record"}).squeeze()
    exact, softer, stiffer = (
        rsfstudy.fit(record, **options | {"stiffness": 3e-3 * factor}).squeeze()
        for factor in (1.0, np.exp(-spread), np.exp(spread))
    )
    assert float(measured["window_stiffness_stderr"]) == pytest.approx(3e-3 * spread)
    assert measured.rsf.fit_table()["k_stderr"][0] == pytest.approx(3e-3 * spread)
    for name in ("a", "b", "slip_distance"):
        added = float(measured[f"{name}_stderr"]) ** 2 - float(exact[f"{name}_stderr"]) ** 2
        moved = 0.5 * float(stiffer[name] - softer[name])
        assert np.sqrt(added) == pytest.approx(abs(moved), rel=0.1)
        assert float(measured[name]) == float(exact[name])


def test_fit_uses_the_stiffness_of_the_record() -> None:
    flat = synthetic.synthetic_record()
    with pytest.raises(InvalidValue, match="part of the record in which the fault is locked"):
        rsfstudy.fit(flat, stiffness="from record", laws=["slowness"])
    held = synthetic.synthetic_record(synthetic.SLIDE_HOLD_SLIDE, size=1e-4)
    ratio, machine, spread = record_fitting._measure_stiffness_in_records([held])
    assert machine == 0.0
    assert 0.0 < spread < 0.2
    assert abs(np.log(ratio / synthetic.EXACT_PARAMETERS["stiffness"])) < 3.0 * spread


def test_summary_has_one_line_per_step_that_is_not_fitted() -> None:
    held = synthetic.synthetic_record(synthetic.SLIDE_HOLD_SLIDE)
    fits = rsfstudy.fit(held, stiffness=3e-3, laws=["slowness"], engine="compiled")
    pieces = [*build_summary_tables_and_sentences(fits)]
    lines = [piece for piece in pieces if isinstance(piece, str) and "is not fitted" in piece]
    assert lines == [
        "step 2 is not fitted: the window begins in a hold, but a fit must begin with steady "
        "sliding"
    ]
    captions = [piece.caption for piece in pieces if hasattr(piece, "caption")]
    assert sum("step 1" in caption for caption in captions) == 1
    assert not any("step 2" in caption for caption in captions)


def test_figure_of_healing() -> None:
    record = peaked_record(noise=1e-4)
    table = rsfstudy.healing(record)
    assert len(rsfstudy.plot_healing(table, record).axes) == 2
    assert len(rsfstudy.plot_healing(table).axes) == 1
    numbers = {"healing_rate_stderr": 0.000664, "healing_intercept": 0.01}
    rounded = table.assign(healing_rate=0.0253, **numbers)
    legend = rsfstudy.plot_healing(rounded).axes[0].get_legend()
    assert r"0.02530 $\pm$ 0.00066 per decade" in [text.get_text() for text in legend.texts]
    with pytest.raises(DataError, match="not a table of holds"):
        rsfstudy.plot_healing(xr.Dataset())
