"""Tests of studies of a rig: axes, scenes, files and results with units."""

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from study_runs import run, run_command, study_of

import rsfstudy
from rsfstudy import Axis, Rig, Scene, Study
from rsfstudy.errors import InvalidValue
from rsfstudy.limit_cycles.limit_cycle import SLIP_MODE_NAMES, LimitCycle
from rsfstudy.reporting import dataset_summaries
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.study import conversion_to_rig_units, study_loader

STATED = {
    "normal_stress": "5 MPa",
    "slip_distance": "10 um",
    "reference_velocity": "1 um/s",
    "stiffness": "0.01 MPa/um",
}
RIG = Rig(**STATED)
LAW = {"law": "slowness", "normal_stress": "constant", "a": 0.01, "b_over_a": 1.4}
#: Tolerance of two rounding errors for each of a few factors.
EXACT = 1e-14


def study(*axes, rig=RIG, measure=None, **fields):
    base = rig.scene(**{**LAW, **fields})
    measure = measure or LinearStability()
    return Study(
        name="of_rig", title="Of a rig", base=base, rig=rig, axes=axes,
        measure=measure,
    )  # fmt: skip


def numbers(scene: Scene) -> dict[str, float]:
    return {name: v for name, v in scene.as_dict().items() if isinstance(v, float)}


AXES = {
    "normal_stress": ["1 MPa", "20 MPa"],
    "slip_distance": ["2 um", "0.05 mm"],
    "reference_velocity": ["1 um/s", "1 mm/s"],
    "stiffness": ["0.01 MPa/um", "0.03 MPa/um"],
}


@pytest.mark.parametrize("varied", list(AXES))
def test_a_quantity_varies_and_all_others_are_held(varied):
    """Each cell equals the scene of a rig with the value of the axis.

    Fields with units keep their values.
    """
    fields = {"hold_time": "100 s", "initial_stress": "50 kPa", "load_velocity_ratio": 3.0}
    scenes = list(study(RIG.axis(varied, AXES[varied]), **fields).scenes())
    for value, scene in zip(AXES[varied], scenes, strict=True):
        theirs = Rig(**STATED | {varied: value}).scene(**LAW, **fields)
        assert numbers(scene) == pytest.approx(numbers(theirs), rel=EXACT)
        assert scene.load_velocity_ratio == 3.0
    if varied != "reference_velocity":
        assert scenes[0].stiffness != scenes[1].stiffness


def test_a_stiffness_in_friction_over_displacement_goes_with_the_normal_stress():
    made = study(
        RIG.axis("stiffness", ["0.002 1/um", "0.004 1/um"]),
        RIG.axis("normal_stress", ["1 MPa", "20 MPa"]),
    )
    # k D_c/sigma = 0.002/um 10 um, independent of sigma.
    found = [scene.stiffness for scene in made.scenes()]
    assert found == pytest.approx([0.02, 0.02, 0.04, 0.04], rel=EXACT)


def test_fields_of_scenes_in_units():
    made = study(
        RIG.axis("hold_time", ["10 s", "2 min"]), RIG.axis("load_velocity", "1:100:3:log um/s")
    )
    assert [axis.units for axis in made.axes] == [{"hold_time": "s"}, {"load_velocity": "um/s"}]
    assert made.axes[0].point_names == ["10 s", "120 s"]
    at = [(scene.hold_time, scene.load_velocity_ratio) for scene in made.scenes()]
    # D_c/V_* is 10 s.
    expected = list(itertools.product([1.0, 12.0], [1.0, 10.0, 100.0]))
    assert np.array(at) == pytest.approx(np.array(expected), rel=EXACT)


def test_rigs_as_an_axis():
    rig20 = Rig(**STATED | {"normal_stress": "20 MPa", "slip_distance": "5 um"})
    made = study(Axis("rig", {"5 MPa": RIG, "20 MPa": rig20}), hold_time="10 s")
    for scene, rig in zip(made.scenes(), (RIG, rig20), strict=True):
        assert numbers(scene) == pytest.approx(numbers(rig.scene(**LAW, hold_time="10 s")))


LATTICE = (
    RIG.axis("normal_stress", ["1 MPa", "5 MPa", "20 MPa"]),
    Axis("law", ["slip", "slowness"]),
    RIG.axis("stiffness", ["0.01 MPa/um", "0.03 MPa/um"]),
    RIG.axis("hold_time", ["0 s", "10 s"]),
)


# ---- files ---------------------------------------------------------------------------------------
def test_coordinates_are_in_the_units_stated_and_dimensionless_ones_stand_beside(tmp_path):
    results = run(study(*LATTICE), output=tmp_path)
    assert results["sigma_star"].dims == ("sigma_star",)
    assert results["sigma_star"].values.tolist() == [1.0, 5.0, 20.0]
    assert results["sigma_star"].attrs["units"] == "MPa"
    assert results["stiffness"].attrs["units"] == "MPa/um"
    beside = results["dimensionless_stiffness"]
    assert beside.dims == ("sigma_star", "stiffness")
    # k D_c/sigma is 0.01 MPa/um 10 um divided by 1, 5 and 20 MPa, and three times this value.
    expected = np.array([[0.1, 0.3], [0.02, 0.06], [0.005, 0.015]])
    assert beside.values == pytest.approx(expected, rel=EXACT)
    assert results["dimensionless_hold_time"].dims == ("hold_time",)
    assert results["reference_rate"].dims == ()
    assert float(results["slip_distance"]) == pytest.approx(1e-5)
    assert results["slip_distance"].attrs["units"] == "m"
    shown = results.rsf.in_units(length="um").rsf.to_dataframe().attrs
    assert shown["constant"]["slip_distance"] == 10.0
    assert shown["units"]["slip_distance"] == "um"


def test_results_survive_their_file(tmp_path):
    made = study(*LATTICE, initial_stress="50 kPa")
    run(made, output=tmp_path)
    opened = rsfstudy.open(tmp_path / "of_rig.nc")
    assert json.loads(opened.attrs["declaration"]) == json.loads(json.dumps(made.describe()))
    again = opened.rsf.study
    assert list(again.scenes()) == list(made.scenes())
    assert opened.isel(sigma_star=1, law=0, stiffness=1, hold_time=0).rsf.scene == made.scene(10)
    assert len(rsfstudy.check(opened)) == 0
    rsfstudy.plot(opened)
    rerun = rsfstudy.rerun(tmp_path / "of_rig.nc", workers=0, progress=False)
    assert (rerun["identical"] == rerun["values"]).all()


# ---- other values ----------------------------------------------------------------------------
def test_overrides_in_units():
    made = study(*LATTICE, initial_stress="50 kPa")
    assert made.with_(hold_time=["10 s", "1 min"]).axes[3].point_names == ["10 s", "60 s"]
    # Plain numbers have the units of their axis.
    assert made.with_(stiffness=[0.02]).axes[2].point_names == ["0.02 MPa/um"]
    assert made.with_(slip_distance=["1 um", "2 um"]).dimensions[0] == "slip_distance"
    assert made.with_(normal_stress=["2 MPa", "5 MPa"]).axes[0].point_names == ["2 MPa", "5 MPa"]
    assert made.with_(normal_stress="constant").base == made.base
    one = made.with_(slip_distance="20 um")
    assert one.rig.slip_distance == pytest.approx(2e-5)
    theirs = Rig(**STATED | {"slip_distance": "20 um"})
    expected = theirs.scene(**LAW, initial_stress="50 kPa")
    assert numbers(one.base) == pytest.approx(numbers(expected), rel=EXACT)
    ramp = {"normal_stress": "imposed", "normal_stress_ramp": "1 MPa", "ramp_duration": "20 s"}
    base = made.with_(**ramp).base
    assert (base.normal_stress_ramp, base.ramp_duration) == pytest.approx((0.2, 2.0), rel=EXACT)


def test_what_states_the_same_takes_the_place_of_an_axis():
    """An override of an equivalent field replaces the axis.

    Velocities replace velocity ratios, stiffness replaces its ratio, and vice versa.
    """
    ratios = study(Axis("load_velocity_ratio", [2.0, 3.0]))
    for given, points in (("10 um/s", [10.0]), (["1 um/s", "5 um/s"], [1.0, 5.0])):
        (axis,) = ratios.with_(load_velocity=given).axes
        assert [row["load_velocity"] for row in axis.rows] == points
        assert axis.units == {"load_velocity": "um/s"}
    velocities = study(RIG.axis("load_velocity", ["1 um/s"]))
    (axis,) = velocities.with_(load_velocity_ratio=3.0).axes
    assert axis == Axis("load_velocity_ratio", [3.0])
    plain = study_of("plain", LimitCycle(), Axis("stiffness_ratio", [0.5, 0.6]))
    changed = plain.with_(stiffness=[0.01, 0.02])
    assert changed.axes == (Axis("stiffness", [0.01, 0.02]),)
    assert changed.scene(1).stiffness == 0.02
    zipped = replace(plain, axes=[Axis("case", {"soft": {"stiffness_ratio": 0.5}})])
    with pytest.raises(InvalidValue, match="stiffness. is equivalent to stiffness_ratio"):
        zipped.with_(stiffness=0.02)
    with pytest.raises(InvalidValue, match="varies the field 'load_velocity_ratio', which"):
        study(RIG.axis("load_velocity", ["1 um/s"]), Axis("load_velocity_ratio", [2.0]))


# ---- results in units ----------------------------------------------------------------------------
#: A rig with a stiffness below the critical stiffness, which is 0.002 MPa/um at 5 MPa and 10 um.
SOFT = STATED | {"stiffness": "0.001 MPa/um"}


@pytest.fixture(scope="module")
def cycles():
    """Run limit cycles at two normal stresses and two slip distances."""
    axes = (
        RIG.axis("normal_stress", ["5 MPa", "20 MPa"]),
        RIG.axis("slip_distance", ["5 um", "10 um"]),
        RIG.axis("load_velocity", ["1 um/s", "10 um/s"]),
    )
    fields = {"period": "5 ms", "inertia": True}
    made = study(*axes, rig=Rig(**SOFT), measure=LimitCycle(), **fields)
    return run(made, engine="compiled", rtol=1e-5)


def test_each_cell_is_converted_by_its_own_scales(cycles):
    """The accessor converts each cell with the scales of its rig."""
    assert (cycles["status"] == 0).all()
    found = cycles.rsf.in_units(stress="kPa", length="mm", time="min")
    for sigma, slip in itertools.product(["5 MPa", "20 MPa"], ["5 um", "10 um"]):
        scale = {
            "recurrence_interval": float(slip.split()[0]) / 60.0,
            "static_stress_drop": float(sigma.split()[0]) * 1e3,
            "slip_per_event": float(slip.split()[0]) * 1e-3,
        }
        at = {"sigma_star": float(sigma.split()[0]), "slip_distance": float(slip.split()[0])}
        for name, factor in scale.items():
            ours, theirs = found[name].sel(at), cycles[name].sel(at)
            assert ours.values == pytest.approx(theirs.values * factor, rel=EXACT), name
    assert found["recurrence_interval"].attrs["units"] == "min"
    # The axes keep their units, and the dimensionless coordinates are dropped.
    assert found["load_velocity"].attrs["units"] == "um/s"
    assert "load_velocity_ratio" not in found
    rates = 1e-3 * 60.0 * 10.0 ** cycles["max_log10_slip_rate"]
    assert found["max_slip_rate"].values == pytest.approx(rates.values, rel=1e-13)


def test_a_slip_rate_in_units_tells_slow_slip_from_stick_slip(cycles):
    """A slip rate with units separates slow slip from stick-slip.

    The peak of each cell in um/s decides, for results in any units.
    """
    peaks = cycles.rsf.in_units()["max_slip_rate"].values
    between = float(np.sqrt(peaks.min() * peaks.max()))
    for results in (cycles, cycles.rsf.in_units(length="mm")):
        modes = results.rsf.slip_mode(f"{between} um/s")
        assert modes.values.tolist() == np.where(peaks >= between, 3.0, 2.0).tolist()
        assert modes.attrs["flag_meanings"].split()[2:] == ["slow_slip", "stick_slip"]
    assert 0 < int((modes == 3.0).sum()) < modes.size
    settled = cycles.assign(slip_mode=xr.zeros_like(cycles["slip_mode"]))
    assert not settled.rsf.slip_mode(1e-9).any()
    with pytest.raises(InvalidValue, match="has units that are incompatible with m/s"):
        cycles.rsf.slip_mode("1 mm")


def test_a_map_of_flags_names_them():
    plane = RIG.axis("stiffness", "1:3:4 kPa/um"), RIG.axis("load_velocity", "1:100:4:log um/s")
    mapped = study(*plane, measure=LimitCycle(phases=2), period="5 ms", inertia=True)
    results = run(mapped, engine="compiled", rtol=1e-3)
    there = np.unique(results["slip_mode"]).tolist()
    assert len(there) > 1
    (panel,) = rsfstudy.plot(results, "slip_mode").axes
    names = [text.get_text() for text in panel.get_legend().get_texts()]
    assert names == [SLIP_MODE_NAMES[int(mode)].replace("_", " ") for mode in there]


def test_one_scale_for_several_rigs_is_refused(cycles):
    with pytest.raises(InvalidValue, match="5e.06 to 2e.07 Pa") as refused:
        cycles.rsf.to_si(normal_stress="5 MPa")
    assert refused.value.name == "normal_stress"
    with pytest.raises(InvalidValue, match="differs from the value in the dataset"):
        RIG.in_units(cycles)
    one = cycles.isel(sigma_star=0, slip_distance=1)
    xr.testing.assert_allclose(RIG.in_units(one), one.rsf.to_si(), rtol=1e-12)
    plain = run(study_of("x", LinearStability(), Axis("b_over_a", [2.0])))
    with pytest.raises(InvalidValue, match="is required, because the dataset does not contain it"):
        plain.rsf.in_units()


def test_figures_and_tables_show_units(cycles, capsys):
    from rsfstudy.cli import table_layout
    from rsfstudy.reporting import lattice_tables

    drawn = rsfstudy.plot(cycles)
    texts = [axes.get_xlabel() + axes.get_ylabel() for axes in drawn.axes]
    assert any(r"Load point velocity" in text and r"($\mu$m/s)" in text for text in texts)
    assert any("(s)" in text for text in texts)
    table_layout.print_table_or_sentence(lattice_tables.build_primary_output_table(cycles))
    said = capsys.readouterr().out
    assert "recurrence interval of stick-slip, in s" in said
    interval = float(cycles.rsf.in_units()["recurrence_interval"][0, 0, 0])
    assert f"{interval:.8g}" in said


def test_results_say_what_they_are_of(cycles):
    """The description contains fixed fields and the quantities of the rig.

    Quantities that vary along an axis are omitted.
    """
    of = dataset_summaries.describe_dataset_origin(cycles)
    assert {"a = 0.01", "b_over_a = 1.4"} <= set(of["fixed fields"].split(", "))
    # In units of the slider, the stiffness depends on D_c and sigma_*.
    assert not {"stiffness", "load_velocity_ratio"} & set(
        of["fixed fields"].replace(",", "").split()
    )
    assert of["rig"].split(", ")[0] == "reference_velocity = 1 um/s"
    assert "slip_distance" not in of["rig"]
    scene = RIG.scene(**LAW, hold_time="10 s")
    motion = RIG.in_units(rsfstudy.simulate(scene, duration=1.0))
    assert dataset_summaries.describe_dataset_origin(motion)["rig"] == (
        "normal_stress = 5 MPa, slip_distance = 10 um, reference_velocity = 1 um/s, "
        "stiffness = 0.01 MPa/um"
    )
    assert "hold_time = 1" in dataset_summaries.describe_dataset_origin(motion)["scene"].split(", ")


# ---- the command line ----------------------------------------------------------------------------
OPTIONS = [
    *("--normal-stress", "5 MPa"),
    *("--slip-distance", "10 um"),
    *("--reference-velocity", "1 um/s"),
]


def test_a_study_of_no_rig_is_put_on_one(tmp_path):
    """A study without a rig can be converted to a rig.

    The axes then have units, the scenes are unchanged, and new values may have units.
    """
    studied = study_loader.load_study("slide_hold_slide")
    rig = Rig(**{n: v for n, v in STATED.items() if n != "stiffness"})
    there = conversion_to_rig_units.convert_study_to_rig_units(studied, rig)
    assert [axis.units for axis in there.axes[1:]] == [{"stiffness": "MPa/um"}, {"hold_time": "s"}]
    # The range of the fit is unchanged, because D_c/V_* is 10 s.
    assert [fit.within for fit in there.reductions] == [(1e5, 1e9)] * 2
    for one, other in zip(studied.scenes(), there.scenes(), strict=True):
        ours, theirs = numbers(one), numbers(other)
        del ours["reference_rate"], theirs["reference_rate"]
        assert ours == pytest.approx(theirs, rel=EXACT)

    words = ["run", "slide_hold_slide", *OPTIONS, "--set", "case=slip law"]
    words += ["--set", "stiffness=0.01 MPa/um", "--set", "hold_time=10 s,100 s"]
    status, said = run_command([*words, "--serial", "--quiet", "--output", str(tmp_path)])
    assert status == 0, said
    results = rsfstudy.open(tmp_path / "slide_hold_slide.nc")
    assert results["hold_time"].values.tolist() == [10.0, 100.0]
    assert results["hold_time"].attrs["units"] == "s"
    assert results["dimensionless_hold_time"].values == pytest.approx([1.0, 10.0])
    assert results["dimensionless_stiffness"].values == pytest.approx([0.02])


def test_what_a_rig_states_of_its_dynamics_takes_the_place_of_that_of_a_study():
    """The dynamics of a rig replace the dynamics of a study.

    Radiation damping replaces inertia, and vice versa.
    """
    scales = {n: v for n, v in STATED.items() if n != "stiffness"}
    radiates = Rig(**scales, shear_modulus="30 GPa", density="2700 kg/m^3")
    swings = Rig(**scales, period="10 ms")
    study = study_loader.load_study("limit_cycles")
    damped = replace(study, base=study.base.with_(inertia=False, radiation_damping=1e-4))
    for before, rig, mass in ((study, radiates, False), (damped, swings, True)):
        there = conversion_to_rig_units.convert_study_to_rig_units(before, rig).base
        assert there.has_mass is mass
        assert (there.radiation_damping == 0.0) is mass
