"""Tests of datasets for plots of plain xarray."""

import json

import numpy as np
import pytest
from matplotlib.figure import Figure
from study_runs import run

import rsfstudy
from rsfstudy import Axis, Scene, Study
from rsfstudy.errors import DataError
from rsfstudy.measures import LinearStability


@pytest.fixture(scope="module")
def results():
    axes = [Axis("law", ["slip", "slowness"]), Axis("b_over_a", [1.5, 2.0, 3.0])]
    scene = Scene(normal_stress="constant", a=0.012)
    title = "Critical stiffness"
    return run(Study(name="mine", title=title, base=scene, axes=axes, measure=LinearStability()))


def test_constants_are_omitted(results):
    simple = results.rsf.simplify()
    constants = json.loads(simple.attrs["constants"])
    varying = {"law", "b_over_a", "a_over_b_minus_a"}
    assert set(simple.coords) | set(constants) == set(results.coords)
    assert set(simple.coords) <= varying | {"b_minus_a"}
    assert {"law", "b_over_a"} <= set(simple.coords)
    assert constants["a"] == 0.012
    assert constants["normal_stress"] == "constant"
    columns = set(simple[["critical_stiffness"]].to_dataframe().reset_index())
    assert columns == {*map(str, simple.coords), "critical_stiffness"}


def test_values_and_the_original_are_unchanged(results):
    before = results.copy(deep=True)
    simple = results.rsf.simplify()
    for name in simple.variables:
        np.testing.assert_array_equal(simple[name].values, results[name].values)
    assert results.identical(before)
    assert results["critical_stiffness"].attrs["units"] == "1"


def test_the_comment_describes_the_units_of_the_dataset(results):
    """The attribute ``scale`` does not exist after a conversion, and the comment follows."""
    assert "attribute scale" in results.attrs["comment"]
    scales = {"normal_stress": "5 MPa", "slip_distance": "10 um"}
    older = results.assign_attrs(
        comment="Quantities are dimensionless: stress in sigma_*, slip in D_c, time in D_c/V_*, "
        "slip rate in V_*. The attribute scale of a variable contains its scale."
    )
    for before in (results, older):
        converted = before.rsf.to_si(**scales)
        for after in (converted, converted.rsf.simplify(), before.rsf.simplify()):
            assert not any("scale" in one.attrs for one in after.variables.values())
            assert "attribute scale " not in after.attrs["comment"]
            assert "Quantities are dimensionless" not in after.attrs["comment"]
        assert "scales" in converted.attrs["comment"]
        assert "scales" in converted.attrs
    own = results.assign_attrs(comment="of the user")
    assert own.rsf.to_si(**scales).attrs["comment"] == "of the user"


def test_plots_of_xarray_have_proper_labels(results):
    axes = Figure().subplots(1, 2)
    simple = results.rsf.simplify()
    simple["critical_stiffness"].isel(law=0).plot(ax=axes[0])
    assert axes[0].get_ylabel().endswith("[sigma_*/D_c]")
    assert "[" not in axes[0].get_xlabel()
    motion = rsfstudy.simulate(Scene(load_velocity_ratio=2.0), duration=1.0).rsf.simplify()
    motion["friction_coefficient"].plot(ax=axes[1])
    assert axes[1].get_xlabel().endswith("[D_c/V_*]")
    assert "[" not in axes[1].get_ylabel()


def test_units_of_a_rig_are_kept():
    rig = rsfstudy.Rig(
        normal_stress="5 MPa", slip_distance="10 um", reference_velocity="1 um/s", period="5 s"
    )
    motion = rsfstudy.simulate(rig.scene(a=0.01, b_over_a=1.5, hold_time="1 s"), duration=1.0)
    simple = rig.in_units(motion, stress="MPa", length="um").rsf.simplify()
    assert simple["slip"].attrs["units"] == "um"
    assert simple["shear_stress"].attrs["units"] == "MPa"


def test_other_datasets_are_rejected(results):
    with pytest.raises(DataError, match="was not created by rsfstudy"):
        results.rsf.simplify().drop_attrs().rsf.simplify()
