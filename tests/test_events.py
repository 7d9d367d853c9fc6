"""Tests of event catalogues of motions, and of records with noise."""

import math

import numpy as np
import pytest
import xarray as xr
from scipy.signal import lfilter

import rsfstudy
from rsfstudy import Scene
from rsfstudy.errors import InvalidValue, NoResultWarning

STICK_SLIP = Scene(b_over_a=2.0, stiffness_ratio=0.5, load_velocity_ratio=10.0, inertia=True)


@pytest.fixture(scope="module")
def motion():
    return rsfstudy.simulate(STICK_SLIP, duration=32.0, engine="compiled", rtol=1e-8)


def test_events_of_a_motion_are_those_of_its_cycle(motion):
    """Events agree with the limit cycle within their error estimates.

    The additional tolerance of 1e-6 covers errors of 1e-8 of both motions, multiplied by
    the size of the numbers and the number of cycles.
    """
    cycle = rsfstudy.limit_cycle(STICK_SLIP, engine="compiled", rtol=1e-8)
    found = motion.rsf.events()
    assert found.sizes["event"] == 4
    for ours, theirs in (
        ("interval", "recurrence_interval"),
        ("static_stress_drop", "static_stress_drop"),
        ("dynamic_stress_drop", "dynamic_stress_drop"),
        ("peak_log10_slip_rate", "max_log10_slip_rate"),
    ):
        event = found.isel(event=2)
        off = abs(float(event[ours] - cycle[theirs]))
        assert off <= float(event[f"{ours}_error"]) + 1e-6, ours
        assert float(event[f"{ours}_error"]) < 1e-3 * abs(float(event[ours])), ours
    assert (found.cut == 0).all()
    # Spring stress decreases by k times the slip in excess of the load point displacement.
    event = found.isel(event=2)
    fell = STICK_SLIP.stiffness * (event.slip - 10.0 * event.duration)
    assert 0.0 < float(event.static_stress_drop - fell) < 0.03 * float(event.static_stress_drop)


def test_crossings_are_read_within_steps(motion):
    """The error estimates cover the sampling of the rupture.

    A motion at given times that miss the rupture has large error estimates.
    """
    event = motion.rsf.events().isel(event=2)
    about = float(event.time) + np.linspace(-0.02, 0.02, 4001)
    asked = rsfstudy.simulate(STICK_SLIP, times=about, engine="compiled", rtol=1e-8)
    again = asked.rsf.events().isel(event=0)
    for name in ("time", "slip", "duration", "peak_log10_slip_rate", "stress_after"):
        allowed = float(event[f"{name}_error"] + again[f"{name}_error"])
        assert abs(float(event[name] - again[name])) <= allowed + 1e-6, name
    assert float(event.time_error) < 2e-6  # The rows are 1e-5 apart.
    assert float(event.slip_error) < 1e-4
    assert float(again.slip_error) > 10.0
    assert int(again.cut) == 1  # Stress has its maximum before the first time.


def test_events_of_a_motion_in_units_are_in_them(motion):
    """Events of a converted motion equal converted events.

    The tolerance is the sum of both error estimates.
    """
    rate = float(motion.reference_rate)
    scales = {"normal_stress": "5 MPa", "slip_distance": 1e-5, "reference_velocity": 1e-5 * rate}
    rig = rsfstudy.Rig(**scales)
    units = {"stress": "MPa", "length": "um"}
    ours = rig.in_units(motion, **units).rsf.events()
    theirs = rig.in_units(motion.rsf.events(), **units)
    for name in ("time", "peak_slip_rate", "slip", "static_stress_drop"):
        errors = ours[f"{name}_error"] + theirs[f"{name}_error"]
        assert (abs(ours[name] - theirs[name]) <= errors).all()
        np.testing.assert_allclose(ours[name], theirs[name], rtol=1e-6)
        assert ours[name].attrs["units"] == theirs[name].attrs["units"]
    assert ours.peak_slip_rate.attrs["units"] == "um s-1"


def test_slip_rate_decides_what_an_event_is(motion):
    quick, slow = motion.rsf.events(1e6), motion.rsf.events(30.0)
    assert quick.sizes["event"] == slow.sizes["event"] == 4
    assert (quick.duration < slow.duration).all()
    assert motion.rsf.events(1e12).sizes["event"] == 0
    with pytest.raises(InvalidValue, match=r"slip_rate must be positive"):
        motion.rsf.events(-1.0)


def test_a_part_of_an_event_is_said_to_be_one(motion):
    begin, duration = (float(motion.rsf.events()[n][2]) for n in ("time", "duration"))
    ends = motion.sel(time=slice(None, begin + 0.5 * duration)).rsf.events()
    assert ends.cut.values.tolist() == [0, 0, 2]
    begins = motion.sel(time=slice(begin + 0.5 * duration, None)).rsf.events()
    assert begins.cut.values.tolist() == [1, 0]


# ---- records ------------------------------------------------------------------------------------

SAMPLES = 20_000


def noise(seed, correlation=0.0):
    """Return Gaussian noise with a standard deviation of 1."""
    white = np.random.default_rng(seed).standard_normal(SAMPLES + 1000)
    return lfilter([math.sqrt(1.0 - correlation**2)], [1.0, -correlation], white)[1000:]


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9, 0.99])
def test_nothing_is_invented_in_noise(correlation):
    """Noise contains no false events, with and without a trend.

    The probability of a false event in 100 records is 1 %, and the seeds are fixed.
    """
    time = np.arange(SAMPLES) / 100.0
    for seed in range(25):
        trend = (seed % 3 - 1) * 1e-3 * time
        found = rsfstudy.events(time=time, shear_stress=noise(seed, correlation) + trend)
        assert not found.sizes["event"], seed


@pytest.mark.parametrize("correlation", [0.0, 0.5])
def test_all_drops_of_three_standard_deviations_are_found(correlation):
    time, places = np.arange(SAMPLES) / 100.0, np.arange(1, 8) * SAMPLES // 8
    for seed in range(15):
        stress = noise(seed, correlation) + 0.01 * time
        stress -= 3.0 * (np.arange(SAMPLES)[:, None] >= places).sum(axis=1)
        found = rsfstudy.events(time=time, shear_stress=stress)
        assert float(found.smallest_drop) < 3.0
        assert float(found.noise) == pytest.approx(1.0, abs=0.1)
        # The events are located to within the window of the detection.
        np.testing.assert_allclose(found.time, time[places], atol=0.5)
        off = np.abs(found.static_stress_drop - 3.0) / found.static_stress_drop_error
        assert float(off.max()) < 5.0  # The largest of 105 deviations.


def test_a_record_tells_slip_rate_and_dynamic_drop(tmp_path):
    """Slip rate and dynamic stress drop follow from the displacement.

    The stress drop lasts ten samples and is twice as fast in its second half.
    """
    fall = np.interp(np.arange(4000), [2000, 2005, 2010], [0.0, 1.0, 3.0])
    time, rng = 0.1 * np.arange(4000), np.random.default_rng(5)
    record = xr.Dataset(
        {
            "time": ("sample", time, {"units": "s"}),
            "displacement": ("sample", 40.0 * fall + rng.normal(0.0, 0.2, 4000), {"units": "um"}),
            "shear_stress": ("sample", 5.0 - fall + rng.normal(0.0, 0.01, 4000), {"units": "MPa"}),
        }
    )
    event = rsfstudy.events(record).isel(event=0)
    assert rsfstudy.events(record).sizes["event"] == 1
    assert float(event.static_stress_drop) == pytest.approx(3.0, abs=0.1)
    assert float(event.slip) == pytest.approx(120.0, abs=4.0)
    # The noise of the slip rate is 2.8, and the peak is the largest of five values.
    assert float(event.peak_slip_rate) == pytest.approx(160.0, abs=10.0)
    assert 0.0 < float(event.dynamic_stress_drop) <= float(event.static_stress_drop) + 0.1
    assert event.slip.attrs["units"] == "um"
    assert event.peak_slip_rate.attrs["units"] == "um s-1"
    assert float(event.time) == pytest.approx(200.0, abs=1.0)
    file = tmp_path / "record.csv"
    header = [f"{name} ({values.units})" for name, values in record.items()]
    record.to_dataframe().to_csv(file, index=False, header=header)
    of_file, of_record = rsfstudy.events(file), rsfstudy.events(record)
    of_file.attrs.pop("history")  # The attribute contains the time of the call.
    of_record.attrs.pop("history")
    xr.testing.assert_identical(of_file, of_record)
    plain = rsfstudy.events(**{name: values.values for name, values in record.items()})
    assert not any("units" in plain[name].attrs for name in ("slip", "peak_slip_rate", "noise"))


def test_a_load_point_moves_on_through_drops(motion):
    """Load point displacement is rejected, or corrected with the stiffness.

    Without a stiffness, the displacement is not accepted as slip. With the stiffness, the
    slip agrees with the slip of the fault. Both displacements spread slip over windows of
    four samples and differ by noise only.
    """
    rng = np.random.default_rng(8)
    time = np.linspace(0.0, 32.0, 10_000)
    stress = np.interp(time, motion.time, motion.shear_stress) + rng.normal(0.0, 1e-4, 10_000)
    slip, load_point = (
        np.interp(time, motion.time, motion[name]) + rng.normal(0.0, 1e-2, 10_000)
        for name in ("slip", "load_point_displacement")
    )
    said = "not increase faster during the stress drops.* stiffness of the rig"
    with pytest.warns(NoResultWarning, match=said):
        refused = rsfstudy.events(time=time, displacement=load_point, shear_stress=stress)
    for name in ("slip", "slip_error", "peak_slip_rate", "dynamic_stress_drop"):
        assert refused[name].isnull().all(), name
    assert refused.slip.attrs["comment"]
    fault = rsfstudy.events(time=time, displacement=slip, shear_stress=stress)
    stiffness = STICK_SLIP.stiffness
    read = rsfstudy.events(
        time=time, displacement=load_point, shear_stress=stress, stiffness=stiffness
    )
    assert fault.sizes["event"] == 4
    np.testing.assert_allclose(read.slip, fault.slip, rtol=0.02)
    dynamic = motion.rsf.events().dynamic_stress_drop
    assert (abs(read.dynamic_stress_drop - dynamic) <= read.dynamic_stress_drop_error).all()
    units = {"time": "s", "displacement": "um", "shear_stress": "MPa"}
    arrays = {"time": time, "displacement": load_point, "shear_stress": stress}
    record = xr.Dataset({n: ("sample", arrays[n], {"units": unit}) for n, unit in units.items()})
    stated = rsfstudy.events(record, stiffness=f"{1e3 * stiffness!r} MPa/mm")
    np.testing.assert_allclose(stated.slip, read.slip, rtol=1e-12)
    with pytest.raises(
        InvalidValue, match="stiffness = '1 MPa/um' cannot .* the record has no units"
    ):
        rsfstudy.events(time=time, displacement=slip, shear_stress=stress, stiffness="1 MPa/um")


def test_slip_counts_that_noise_moves_the_place_of_an_event():
    """The error of slip includes the error of the event location.

    Noise shifts some of 160 events by one sample, and a shift by one sample changes the
    slip by 2.5 of 10 in a window of four samples.
    """
    rng, count = np.random.default_rng(3), 8000
    off = []
    for _record in range(20):
        stress, moved = rng.normal(size=count), 0.01 * rng.normal(size=count)
        for at in np.sort(rng.choice(np.arange(200, count - 200, 300), 8, replace=False)):
            stress[at:] -= 5.0
            moved[at:] += 10.0
        found = rsfstudy.events(time=np.arange(count), shear_stress=stress, displacement=moved)
        # The error is half of a 95 % interval, that is two standard errors.
        assert (found.slip_error < 0.02).all()
        off += ((found.slip - 10.0) / found.slip_error).values.tolist()
    assert np.abs(off).max() < 5.0
