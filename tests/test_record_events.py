"""Tests of events of synthetic records with known drops."""

from __future__ import annotations

import numpy as np
import pytest
import record_events as synthetic
import xarray as xr

import rsfstudy
from rsfstudy import Scene
from rsfstudy.errors import InvalidValue, NoResultWarning


@pytest.mark.parametrize("kind", synthetic.KINDS)
def test_drops_are_found_with_errors_that_cover(kind: str) -> None:
    """All large drops are found, and most errors cover.

    With a coverage of 95 %, the probability that at least three of 18 errors fail is 6 %.
    """
    found = synthetic.score_record(
        synthetic.KINDS[kind](np.random.default_rng([1, *kind.encode()]))
    )
    assert found.large > 0
    assert (found.found, found.false) == (found.large, 0)
    assert found.sizes >= found.matched - 3
    assert found.times >= found.matched - 3


def test_a_drop_at_the_end_of_the_record_is_cut() -> None:
    made = synthetic.cut_record(np.random.default_rng(3))
    found = rsfstudy.events(time=made.time, shear_stress=made.stress)
    assert found["cut"].values.tolist() == [0] * (len(made.begins) - 1) + [2]
    # The record is split in the middle of the third drop.
    middle = made.begins[2] + 0.5 * made.durations[2]
    later = made.time >= middle
    begins = rsfstudy.events(time=made.time[later], shear_stress=made.stress[later])
    assert begins["cut"].values[0] == 1
    assert begins.sizes["event"] == len(made.begins) - 2


def test_a_short_drop_is_not_averaged_away() -> None:
    """The mean size of short drops is correct within its error.

    The drops last five samples.
    """
    rng = np.random.default_rng(4)
    made = synthetic.draw_record(rng, 0.01 * np.arange(8_000), size=(0.4, 0.4), lasts=(0.05, 0.05))
    found = rsfstudy.events(time=made.time, shear_stress=made.stress)
    off = found.static_stress_drop.values - 0.4
    assert len(off) == len(made.begins)
    assert abs(off.mean()) < 3.0 * off.std() / np.sqrt(len(off)) + 0.004


def test_the_sign_of_shear_stress() -> None:
    made = synthetic.sudden_drops(np.random.default_rng(5))
    positive = rsfstudy.events(time=made.time, shear_stress=made.stress)
    negative = rsfstudy.events(time=made.time, shear_stress=-made.stress)
    assert negative.attrs["sign_of_shear_stress"] == -1
    np.testing.assert_array_equal(negative.stress_before, positive.stress_before)
    shifted = made.stress - 5.0  # The shifted stress has both signs.
    centred = rsfstudy.events(time=made.time, shear_stress=-shifted, sign=-1)
    np.testing.assert_allclose(centred.time, positive.time, atol=1e-9)
    assert rsfstudy.events(time=made.time, shear_stress=shifted).sizes["event"] == len(made.begins)
    with pytest.raises(InvalidValue, match="'sign' must be 1 or -1"):
        rsfstudy.events(time=made.time, shear_stress=shifted, sign=2)


def test_stress_that_varies_without_drops_is_reported() -> None:
    time = 0.02 * np.arange(10_000)
    wave = 5.0 + np.cos(2.0 * np.pi * time / 150.0)
    noise = np.random.default_rng(6).normal(size=len(time))
    with pytest.warns(
        NoResultWarning, match="no drop was detected, although stress decreases by 2.0"
    ):
        found = rsfstudy.events(time=time, shear_stress=wave + 0.02 * noise)
    assert found.sizes["event"] == 0
    assert "times the smallest detectable drop" in found.attrs["comment"]


def test_events_of_a_record_as_fits_read_it() -> None:
    made = synthetic.sudden_drops(np.random.default_rng(7))
    columns = {"time": made.time, "displacement": made.time, "shear_stress": made.stress}
    record = rsfstudy.read_record(columns, normal_stress="8 MPa")
    with pytest.warns(
        NoResultWarning, match="does not increase faster"
    ):  # The displacement is the load point displacement.
        found = rsfstudy.events(record)
    plain = rsfstudy.events(time=made.time, shear_stress=made.stress)
    np.testing.assert_allclose(found.static_stress_drop, plain.static_stress_drop, rtol=1e-6)
    assert found.static_stress_drop.attrs["units"] == "MPa"
    with pytest.raises(InvalidValue, match="is not a record"):
        rsfstudy.events([1.0, 2.0])


# ---- records of simulated events ----------------------------------------------------------------

#: Law of friction, loading velocity and relative stiffness of simulated stick-slip with inertia.
SIMULATED = {"slip": ("slip", 1.05, 0.85), "slowness": ("slowness", 1.05, 0.7)}
SAMPLES_PER_INTERVAL, NOISE_OVER_DROP = (40, 200, 2000), (0.0006, 0.006, 0.02)


@pytest.fixture(scope="module", params=SIMULATED)
def simulated(request: pytest.FixtureRequest) -> tuple[xr.Dataset, xr.Dataset, float]:
    """Return a motion with inertia, its events and the stiffness."""
    law, velocity, stiffness = SIMULATED[request.param]
    scene = Scene(
        law=law,
        normal_stress="constant",
        b_over_a=1.375,
        stiffness_ratio=stiffness,
        load_velocity_ratio=velocity,
        inertia=True,
    )
    motion = rsfstudy.simulate(scene, duration=900.0, engine="compiled")
    return motion, motion.rsf.events(), float(scene.stiffness)


def draw_samples(
    simulated: tuple[xr.Dataset, xr.Dataset, float], samples: int, noise: float, seed: int
) -> xr.Dataset:
    """Return the events of a noisy record of a simulated motion."""
    motion, events, stiffness = simulated
    step = float(events.interval[-1]) / samples
    rng = np.random.default_rng([samples, seed])
    time = np.arange(rng.uniform(0.0, step), float(motion.time[-1]), step)
    stress, moved = (
        np.interp(time, motion.time, motion[name])
        for name in ("shear_stress", "load_point_displacement")
    )
    stress += noise * float(events.static_stress_drop[-1]) * rng.standard_normal(len(time))
    return rsfstudy.events(time=time, displacement=moved, shear_stress=stress, stiffness=stiffness)


def match_events(found: xr.Dataset, events: xr.Dataset) -> tuple[xr.Dataset, xr.Dataset]:
    """Return the nearest events of the record, and the events after the transient motion."""
    true = events.isel(event=slice(4, -1))
    places = np.abs(found.time.values - true.time.values[:, None]).argmin(axis=1)
    return found.isel(event=places), true


def test_stress_drops_of_simulated_events_lie_in_their_intervals(
    simulated: tuple[xr.Dataset, xr.Dataset, float],
) -> None:
    """Stress drop, highest and lowest stress are independent of the sampling.

    Stress has a gradual maximum before each event. The intervals of the stress drop are wider than
    necessary. The intervals of the highest and the lowest stress have a coverage of about 90 % in
    strong noise. The errors must not exceed the effects of the noise and of the sampling interval.
    """
    size = float(simulated[1].static_stress_drop[-1])
    missed = dict.fromkeys(("static_stress_drop", "stress_before", "stress_after"), 0)
    total = 0
    for samples in SAMPLES_PER_INTERVAL:
        for noise in NOISE_OVER_DROP:
            for seed in range(2):
                found, true = match_events(
                    draw_samples(simulated, samples, noise, seed), simulated[1]
                )
                total += true.sizes["event"]
                for name in missed:
                    off = abs(found[name].values - true[name].values)
                    late = int((off > found[f"{name}_error"].values).sum())
                    assert late <= 0.4 * true.sizes["event"], (samples, noise, name)
                    missed[name] += late
                error = float(found.static_stress_drop_error.mean())
                assert error < (5.0 * noise + 6.0 / samples) * size, (samples, noise)
    assert total > 150
    assert missed["static_stress_drop"] < 0.05 * total
    assert max(missed.values()) < 0.1 * total


@pytest.mark.parametrize("noise", NOISE_OVER_DROP[1:])
def test_the_noise_excludes_the_curvature_of_stress(
    simulated: tuple[xr.Dataset, xr.Dataset, float], noise: float
) -> None:
    size = float(simulated[1].static_stress_drop[-1])
    for samples in SAMPLES_PER_INTERVAL[1:]:
        found = draw_samples(simulated, samples, noise, 0)
        assert float(found.noise) == pytest.approx(noise * size, rel=0.15)


def test_unresolved_peak_slip_rates_are_lower_bounds(
    simulated: tuple[xr.Dataset, xr.Dataset, float],
) -> None:
    """The error is NaN if the rupture is shorter than a few sampling intervals."""
    found, true = match_events(draw_samples(simulated, 200, 0.006, 0), simulated[1])
    peak = 10.0**true.peak_log10_slip_rate.values
    assert found.peak_slip_rate_error.isnull().all()
    assert (found.peak_slip_rate.values < peak).all()
    assert "lower bound" in found.peak_slip_rate.attrs["comment"]


def test_the_error_of_a_resolved_peak_slip_rate_covers_the_peak() -> None:
    """The slip rate is a parabola that lasts 20 sampling intervals."""
    rng, time = np.random.default_rng(9), np.arange(4000.0)
    for shift in np.linspace(0.0, 1.0, 6):
        x = np.clip((time - 2000.0 - shift) / 10.0, -1.0, 1.0)
        slip = 7.5 * (x - x**3 / 3.0 + 2.0 / 3.0)  # The peak slip rate is 0.75.
        stress = 5.0 - 0.5 * slip + 0.01 * rng.standard_normal(len(time))
        found = rsfstudy.events(time=time, displacement=slip, shear_stress=stress)
        event = found.isel(event=0)
        error = float(event.peak_slip_rate_error)
        assert 0.0 <= 0.75 - float(event.peak_slip_rate) <= error < 0.02
        # The stress at the peak is in the middle of the drop.
        drop, error = float(event.dynamic_stress_drop), float(event.dynamic_stress_drop_error)
        assert abs(drop - 2.5) <= error < 0.6


def test_a_decreasing_stress_has_a_drop_at_its_beginning() -> None:
    """If stress decreases before and after a drop, the drop contains only the sudden decrease."""
    time = np.arange(4000.0)
    stress = 5.0 - 1e-4 * time - 0.5 * (time >= 2000.5)
    stress += 0.005 * np.random.default_rng(10).standard_normal(len(time))
    event = rsfstudy.events(time=time, shear_stress=stress).isel(event=0)
    assert abs(float(event.static_stress_drop) - 0.5) <= float(event.static_stress_drop_error)
    assert float(event.static_stress_drop_error) < 0.05
