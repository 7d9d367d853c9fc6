"""Tests of the units of a rig: conversions and invalid quantities."""

import json
import math
import re

import numpy as np
import pytest
import xarray as xr
from study_runs import call_main, run, run_command

import rsfstudy
from rsfstudy import Axis, Rig, Scene, Study, limit_cycle, protocol, read_protocol, simulate
from rsfstudy.errors import DataError, InvalidValue, NoResultWarning
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.plots._motion import plot_motion
from rsfstudy.slider.loading import Segment
from rsfstudy.slider.part_registry import SCENE_FIELD_QUANTITIES

SIGMA, D_C, V = 5e6, 1e-5, 1e-6
RIG = Rig(
    normal_stress="5 MPa",
    slip_distance="10 um",
    reference_velocity="1 um/s",
    stiffness="0.05 MPa/um",
)
THREE = {"normal_stress": SIGMA, "slip_distance": D_C, "reference_velocity": V}
LAW = {"law": "slowness", "normal_stress": "constant", "a": 0.01, "b_over_a": 1.4}


#: The scales of the rig in SI units.
SCALES = {
    "sigma_*": SIGMA, "D_c": D_C, "V_*": V, "D_c/V_*": D_C / V, "V_*/D_c": V / D_C,
    "sigma_*/D_c": SIGMA / D_C,
}  # fmt: skip


def test_scales_by_dimension():
    """The exponents of kilogram, metre and second agree with the SI unit."""
    exponents = {"Pa": (1, -1, -2), "m": (0, 1, 0), "s": (0, 0, 1)}
    of = {
        "sigma_*": (1, -1, -2), "D_c": (0, 1, 0), "V_*": (0, 1, -1), "D_c/V_*": (0, 0, 1),
        "V_*/D_c": (0, 0, -1), "sigma_*/D_c": (1, -2, -2),
    }  # fmt: skip
    for name, scale in RIG.si_scale_by_dimensionless_unit.items():
        assert scale.factor == pytest.approx(SCALES[name], rel=1e-15)
        total = np.zeros(3)
        for text in scale.units.split():
            unit, power = (text[:-2], -1) if text.endswith("-1") else (text, 1)
            total += power * np.array(exponents[unit])
        assert tuple(total) == of[name], name


#: A quantity for each scale of the scene fields, and its dimensionless value.
VALUES = {
    "D_c": ("25 um", 2.5), "V_*": ("10 um/s", 10.0), "D_c/V_*": ("1 min", 6.0),
    "sigma_*/D_c": ("0.1 MPa/um", 0.2), "sigma_*": ("50 kPa", 0.01),
    "V_*/D_c": ("0.05 1/s", 0.5),
}  # fmt: skip
CALLS: dict[str, dict] = {
    "displacement_between_steps": {"velocity_steps": 2},
    "oscillation_period": {"oscillation_amplitude": 0.01},
    "oscillation_begin": {"oscillation_amplitude": 0.01},
    "ramp_duration": {"normal_stress_ramp": 0.01},
    "velocity_ramp_duration": {"velocity_ramp": 2.0},
    "load_velocity_ratio": {},
    **{name: {"fluid": "dilatant"} for name in ("dilatancy", "drainage", "porosity_length")},
    "weakening_velocity_ratio": {"law": "flash_heating"},
    "noise_interval": {"loading_noise": "white", "stress_noise": 1e-4},
    "noise_correlation_time": {"loading_noise": "correlated", "stress_noise": 1e-4},
    "cooling": {"temperature": "shear_heating"},
    "pressurisation": {"temperature": "shear_heating", "fluid": "thermal"},
}


@pytest.mark.parametrize(
    "about", [q for q in SCENE_FIELD_QUANTITIES if q.scale], ids=lambda q: q.name
)
def test_every_field_with_a_scale_takes_units(about):
    text, value = VALUES[about.scale]
    rig = Rig(normal_stress=SIGMA, slip_distance=D_C, reference_velocity=V)
    scene = rig.scene(**CALLS.get(about.name, {}), **{about.name: text})
    assert getattr(scene, about.name) == pytest.approx(value, rel=1e-12)
    assert scene.reference_rate == V / D_C
    with pytest.raises(
        InvalidValue, match=rf"{about.name} = '1 kg' has units that are incompatible with"
    ):
        rig.scene(**{about.name: "1 kg"})


def test_plain_numbers_are_si_and_ratios_stay_ratios():
    scene = RIG.scene(**LAW, hold_time=100.0, load_velocity_ratio=2.0)
    assert scene.hold_time == pytest.approx(10.0)
    assert scene.load_velocity_ratio == 2.0
    assert scene.stiffness == pytest.approx(5e10 * D_C / SIGMA, rel=1e-14)
    assert RIG.scene(displacement_step=5e-6).displacement_step == pytest.approx(0.5)
    assert RIG.dimensionless("10 min") == pytest.approx(60.0)


def test_mass_and_radiation():
    heavy = Rig(
        normal_stress=SIGMA,
        slip_distance=D_C,
        reference_velocity=V,
        stiffness=5e10,
        mass="2e4 kg/m^2",
    )
    period = 2.0 * math.pi * math.sqrt(2e4 / 5e10)
    assert heavy.scene().inertia
    assert heavy.scene().period == pytest.approx(period)
    still = heavy.scene(inertia=False)
    assert (still.inertia, still.period) == (False, heavy.scene().period)
    timed = Rig(**THREE, period="10 ms")
    assert (timed.scene().inertia, timed.scene().period) == (True, pytest.approx(0.01))
    assert not Rig(**THREE).scene().inertia
    radiating = Rig(
        normal_stress=SIGMA, slip_distance=D_C, reference_velocity=V,
        shear_modulus="30 GPa", density="2700 kg/m^3",
    )  # fmt: skip
    # G/(2 c_s) with c_s = sqrt(G/rho)
    impedance = 30e9 / (2.0 * math.sqrt(30e9 / 2700.0))
    assert radiating.scene().radiation_damping == pytest.approx(impedance * V / SIGMA, rel=1e-12)


def test_a_scale_that_is_unusual_is_told():
    with pytest.warns(UserWarning, match="slip_distance is 1 m: this value is unusual for a rig"):
        Rig(**{**THREE, "slip_distance": 1.0})


def test_results_say_their_units():
    """Results in units of the rig agree with the conversion by ``to_si``."""
    scene = RIG.scene(**LAW, velocity_steps=1)
    motion = simulate(scene, duration=2.0, rtol=1e-4)
    shown = RIG.in_units(motion, stress="MPa", length="um", time="min")
    plain = rsfstudy.to_si(motion, normal_stress=SIGMA, slip_distance=D_C)
    for name, factor, units in (
        ("time", 60.0, "min"), ("slip", 1e-6, "um"), ("shear_stress", 1e6, "MPa"),
        ("load_point_displacement", 1e-6, "um"),
    ):  # fmt: skip
        assert shown[name].attrs["units"] == units
        assert "scale" not in shown[name].attrs
        np.testing.assert_allclose(shown[name] * factor, plain[name], rtol=1e-14)
    assert shown.slip_rate.attrs["units"] == "um min-1"
    assert float(shown.slip_rate[0]) == pytest.approx(60.0)
    assert shown.friction_coefficient.attrs["units"] == "1"
    assert shown.effective_normal_stress.attrs["units"] == "MPa"
    assert float(shown.effective_normal_stress[0]) == pytest.approx(SIGMA / 1e6)
    assert '"normal_stress": 5000000.0' in shown.attrs["laboratory"]
    with pytest.raises(DataError, match="was already converted"):
        RIG.in_units(shown)
    # The displacement of the load point is 10 V_* t.
    np.testing.assert_allclose(motion.load_point_displacement, 10.0 * motion.time, atol=1e-9)


def heavy_cycles(axis):
    """Return limit cycles of which each has a different reference rate."""
    study = Study(
        name="rates", title="Cycles at two rates", measure=LimitCycle(phases=2),
        base=Scene(stiffness_ratio=0.8, load_velocity_ratio=2.0, inertia=True),
        axes=[Axis("reference_rate", [1e-2, 8e-3]), axis],
    )  # fmt: skip
    return run(study, rtol=1e-4)


def test_each_cell_is_converted_by_its_own_reference_rate():
    """Each cell is converted in the same way as a single cell."""
    results = heavy_cycles(Axis("b_over_a", [1.5, 2.0]))
    found = rsfstudy.to_si(results, normal_stress=SIGMA, slip_distance=D_C)
    rates = np.array([[1e-2], [8e-3]])
    interval = results.recurrence_interval.values
    assert np.isfinite(interval).all()
    # Products of the same numbers differ by rounding errors only.
    np.testing.assert_allclose(found.recurrence_interval, interval / rates, rtol=1e-14)
    fastest = 10.0**results.max_log10_slip_rate.values * D_C * rates
    np.testing.assert_allclose(found.max_slip_rate, fastest, rtol=1e-13)
    assert found.recurrence_interval.dims == results.recurrence_interval.dims
    error = results.max_log10_slip_rate_error.values * math.log(10.0) * fastest
    np.testing.assert_allclose(found.max_slip_rate_error, error, rtol=1e-12)
    assert "D_c/V_* = 100 to 125 s" in found.attrs["scales"]
    for scalar in (1e-2, "0.008 1/s"):
        with pytest.raises(
            InvalidValue, match="differs from the value in the dataset, 0.008 to 0.01 1"
        ):
            rsfstudy.to_si(results, normal_stress=SIGMA, slip_distance=D_C, reference_rate=scalar)
    one = results.isel(reference_rate=1)
    stated = rsfstudy.to_si(one, normal_stress=SIGMA, slip_distance=D_C, reference_rate="0.008 1/s")
    np.testing.assert_allclose(stated.recurrence_interval, interval[1] / 8e-3, rtol=1e-14)


def test_an_axis_whose_scale_varies_along_another_is_refused():
    results = heavy_cycles(Axis("load_velocity_ratio", [1.5, 2.0]))
    with pytest.raises(DataError, match=r"load_velocity_ratio varies .*isel\(reference_rate=0\)"):
        rsfstudy.to_si(results, normal_stress=SIGMA, slip_distance=D_C)
    one = results.isel(reference_rate=0).rsf.to_si(normal_stress=SIGMA, slip_distance=D_C)
    np.testing.assert_allclose(one.load_velocity, np.array([1.5, 2.0]) * 1e-2 * D_C, rtol=1e-14)


# ---- protocols from files ------------------------------------------------------------------------

RECORD = "velocity (um/s), distance (um), duration (min)\n10, 300,\n1, 300,\n\n0,, 10\n1, 200,\n"


def test_a_protocol_from_a_file(tmp_path):
    path = tmp_path / "test.csv"
    path.write_text("\ufeff" + RECORD)
    read = read_protocol(path, RIG, "steps_and_hold")
    assert read.name == "steps_and_hold"
    steps = [(10.0, 0.0, 3.0), (1.0, 0.0, 30.0), (0.0, 0.0, 60.0), (1.0, 0.0, math.inf)]
    assert np.array(read.segments) == pytest.approx(
        np.array([(*step, 0.0) for step in steps]), rel=1e-12
    )
    assert read.duration == pytest.approx(113.0)
    motion = simulate(RIG.scene(**LAW, loading=read), rtol=1e-4)
    assert float(motion.time[-1]) == pytest.approx(113.0)
    assert float(motion.load_point_displacement[-1]) == pytest.approx(80.0, rel=1e-6)
    path.write_text("velocity [V_*], duration [D_c/V_*]\n2, 3\n1,\n")
    assert read_protocol(path).input_segments == (Segment(2.0, 0.0, 3.0), Segment(1.0))
    assert RIG.protocol([{"velocity": "2 um/s", "step": "5 um"}]).input_segments == (
        Segment(2.0, 0.5),
    )


# ---- pictures ------------------------------------------------------------------------------------


@pytest.mark.parametrize("laboratory", [None, RIG])
@pytest.mark.parametrize("against", ["load_point_displacement", "time"])
def test_the_picture_of_a_motion(laboratory, against):
    """The line of steady sliding is independent of the loading."""
    scene = RIG.scene(**LAW, loading=protocol([{"velocity": 3, "duration": 2}], "three"))
    drawn = plot_motion(simulate(scene, rtol=1e-4), laboratory, against=against)
    upper, lower, plane = drawn.axes
    units = {"time": ("D_c/V_*", "(s)"), "load_point_displacement": ("D_c", r"$\mu$m")}
    assert units[against][laboratory is not None] in lower.get_xlabel()
    assert all(axes.get_ylabel() for axes in (upper, lower, plane))
    path, _start, steady = plane.get_lines()
    rates, friction = steady.get_data()
    # V_* is 1 um/s.
    expected = scene.mu_star + (scene.a - scene.b) * np.log(np.asarray(rates))
    np.testing.assert_allclose(friction, expected, rtol=1e-12)
    assert np.asarray(path.get_xdata()).max() > 2.5


def test_a_limit_cycle_has_a_picture():
    """The figure of a limit cycle is a closed curve in units of the rig."""
    scene = RIG.scene(**LAW, load_velocity_ratio=2.0).with_(stiffness_ratio=0.8, inertia=True)
    cycle = limit_cycle(scene, rtol=1e-4)
    upper, lower, plane = cycle.rsf.plot(RIG).axes
    assert (upper.get_ylabel(), lower.get_xlabel()) == ("Shear stress (MPa)", "Time (s)")
    rates, friction = np.array(plane.get_lines()[0].get_data())
    assert friction[0] == pytest.approx(friction[-1], abs=1e-6)
    assert rates[0] == pytest.approx(2.0, rel=1e-6)  # 2 um/s


def test_the_picture_of_steady_sliding_has_limits_about_its_slip_rate():
    """The axis limits enclose the constant slip rate.

    Equal limits would cause a warning of Matplotlib, which is an error in the tests.
    """
    with pytest.warns(NoResultWarning, match="the scene has no step"):
        motion = simulate(RIG.scene(**LAW), duration=1.0)
    low, high = plot_motion(motion, RIG).axes[1].get_ylim()
    assert low < 1.0 < high  # V_* = 1 um/s


def test_the_command_simulates_a_rig(tmp_path):
    path = tmp_path / "test.csv"
    path.write_text(RECORD)
    words = ["simulate", "--protocol", path, "--output", tmp_path / "out" / "test.png"]
    words += ["--normal-stress", "5 MPa", "--slip-distance", "10 um", "--rtol", "1e-4"]
    words += ["--reference-velocity", "1e-6", "--stiffness", "0.05 MPa/um"]
    words += [word for name, value in LAW.items() for word in ("--set", f"{name}={value}")]
    ran = call_main(*words)
    assert ran.returncode == 0, ran.stderr
    assert (tmp_path / "out" / "test.png").stat().st_size > 10_000
    told = " ".join(ran.stdout.split())
    assert "duration 1130 s peak friction 0." in told
    assert re.search(r"peak slip rate [\d.]+ um/s after [\d.]+ s friction at the end 0\.", told)
    with xr.open_dataset(tmp_path / "out" / "test.nc") as written:
        assert written.load_point_displacement.attrs["units"] == "um"
        assert float(written.time[-1]) == pytest.approx(1130.0)


@pytest.mark.parametrize(
    ("stated", "fields"),
    [
        (["--period", "10 ms"], {"inertia": True, "period": 0.01}),
        (["--period", "10 ms", "--set", "inertia=false"], {"inertia": False, "period": 0.01}),
        (["--mass", "2e4 kg/m^2", "--stiffness", "50 GPa/m"], {"inertia": True}),
        (["--shear-modulus", "30 GPa", "--density", "2700 kg/m^3"], {"radiation_damping": 9e-7}),
    ],
)
def test_what_options_of_a_rig_state_acts(stated, fields, tmp_path):
    words = ["simulate", *stated, "--output", tmp_path / "motion.png", "--duration", "1 s"]
    words += ["--normal-stress", "5 MPa", "--slip-distance", "10 um"]
    words += ["--reference-velocity", "1 um/s", "--rtol", "1e-3", "--load-velocity", "2 um/s"]
    code, said = run_command([str(word) for word in words])
    assert code == 0, said
    with xr.open_dataset(tmp_path / "motion.nc") as written:
        told = json.loads(written.attrs["scene"])
    fields = {**fields, "load_velocity_ratio": 2.0}
    # sqrt(G rho)/2 = 4.5 MPa s/m, and V_*/sigma_* = 2e-13 m/s/Pa
    assert {name: told[name] for name in fields} == pytest.approx(fields, rel=1e-12)


def test_a_motion_replaces_a_motion_whole_and_nothing_else(tmp_path):
    stable = "--set", "load_velocity_ratio=2", "--set", "stiffness_ratio=2"
    words = ["simulate", *stable, "--rtol", "1e-4", "--duration"]
    data, image = tmp_path / "motion.nc", tmp_path / "motion.png"
    assert call_main(*words, "5", "--output", image).returncode == 0
    with xr.open_dataset(data) as seen:
        assert call_main(*words, "9", "--output", image).returncode == 0
        # An open dataset keeps the data of the old file.
        assert float(seen.time[-1]) == pytest.approx(5.0)
    with xr.open_dataset(data) as seen:
        assert float(seen.time[-1]) == pytest.approx(9.0)
    assert sorted(tmp_path.iterdir()) == [data, image]
    run(output=tmp_path / "study")
    for other in (b"a plain text", (tmp_path / "study" / "small.nc").read_bytes()):
        data.write_bytes(other)
        ran = call_main(*words, "5", "--output", image)
        assert ran.returncode == 2
        assert "already exists and does not contain a motion" in " ".join(ran.stderr.split())
        assert data.read_bytes() == other


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({}, "constant"),
        ({"hold_time": "10 s"}, "constant"),
        ({"normal_stress_step": "1 MPa"}, "imposed"),
        ({"alpha": 0.3}, "imposed"),
        ({"phi": 50.0}, "variable"),
        ({"normal_stress": "variable"}, "variable"),
    ],
)
def test_a_rig_starts_from_constant_normal_stress(fields, expected):
    assert RIG.scene(**fields).normal_stress == expected
    with pytest.raises(InvalidValue, match="must be greater than 0 .got -1"):
        RIG.scene(a=-1.0, **fields)
