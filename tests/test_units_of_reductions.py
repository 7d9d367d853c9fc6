"""Tests of the units of reductions."""

import numpy as np
import pytest
import xarray as xr
from study_runs import run, study_of

from rsfstudy import Rig
from rsfstudy.reductions import (
    Boundary,
    ClosedFormRatio,
    Difference,
    Inverse,
    LinearFit,
    Mean,
    PowerLaw,
    ProportionalFit,
    Quantile,
    Range,
    RelativeDifference,
    SemilogFit,
    StandardDeviation,
    apply_reductions,
)
from rsfstudy.reporting import lattice_tables, reduction_tables
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.rig.dataset_unit_scales import convert_to_display_units
from rsfstudy.study.reductions.base import read_quantities_not_in_vocabulary
from rsfstudy.study.reductions.unit_conversion import InUnits

X = np.geomspace(1.0, 30.0, 12)


def lattice(**scales) -> xr.Dataset:
    """Return times in D_c/V_* along a length, a velocity and a number.

    The rig has 5 MPa, 10 um and 2 um/s by default. The length is in D_c, and the velocity
    is in um/s.
    """
    random = np.random.default_rng(12)
    times = 40.0 * X**-0.9 * random.uniform(0.95, 1.05, (2, X.size))
    return xr.Dataset(
        {
            "time_to": (("law", "x"), times, {"units": "1", "scale": "D_c/V_*"}),
            "time_to_error": (("law", "x"), 1e-6 * times, {"units": "1", "scale": "D_c/V_*"}),
            "above": (("law", "x"), np.tile(1.0 * (X > 5.0), (2, 1)), {"units": "1"}),
            "falling": (("law", "x"), 1.0 / np.stack([X, X + 1.0]), {"units": "1"}),
            "status": (("law", "x"), np.zeros((2, X.size), np.int8)),
        },
        coords={
            "law": ["slip", "slowness"],
            "b_over_a": 2.0,
            "number": ("x", X, {"units": "1"}),
            "length": ("x", 3.0 * X, {"units": "1", "scale": "D_c"}),
            "speed": ("x", 7.0 * X, {"units": "um/s"}),
            "sigma_star": scales.get("sigma_star", ((), 5.0, {"units": "MPa"})),
            "slip_distance": scales.get("slip_distance", ((), 1e-5, {"units": "m"})),
            "reference_velocity": ((), 2e-6, {"units": "m s-1"}),
            "reference_rate": scales.get("reference_rate", ((), 0.2, {"units": "s-1"})),
        },
    )


OF, ALONG = "time_to", {"along": "law", "reference": "slip"}
#: Reductions with their units on a rig. The names do not determine the units.
KINDS = {
    LinearFit("static_slope", OF, on="number"): "s",
    LinearFit("zeta", OF, on="length"): "s (um)-1",
    LinearFit("per_speed", OF, on="speed"): "s (um/s)-1",
    LinearFit("rise", "falling", on="length"): "1 (um)-1",
    ProportionalFit("displacement_slope", OF, on="number"): "s",
    SemilogFit("per_decade", OF, on="speed"): "s",
    PowerLaw("exponent", OF, on="speed"): "1",
    Difference("lowering", OF, **ALONG): "s",
    RelativeDifference("separation", OF, **ALONG): "1",
    Range("span", OF, over="x"): "s",
    Mean("mean", OF, over="x"): "s",
    StandardDeviation("sd", OF, over="x"): "s",
    Quantile("median", OF, over="x"): "s",
    Boundary("lattice_boundary", "above", on="length"): "um",
    Boundary("edge", "above", on="speed"): "um/s",
    Inverse("reached", "falling", on="length", levels=0.1): "um",
    Difference("steeper", "zeta", **ALONG): "s (um)-1",
    ClosedFormRatio("ratio", "above", form="displacement_step"): "1",
}


def test_what_is_made_of_a_lattice_in_units_is_that_of_numbers_in_units():
    """Reductions commute with unit conversion, to rounding error.

    Each reduction is homogeneous in its variable and its coordinate, including errors and
    misfits.
    """
    made, dataset = apply_reductions(lattice(), tuple(KINDS)), lattice().assign_coords(a=0.01)
    ours, theirs = (
        convert_to_display_units(made),
        apply_reductions(convert_to_display_units(dataset), tuple(KINDS)),
    )
    assert {r.name: ours[r.name].attrs["units"] for r in KINDS} == {
        r.name: units for r, units in KINDS.items()
    }
    for name in set(theirs) - set(dataset):
        assert ours[name].attrs["units"] == theirs[name].attrs["units"], name
        np.testing.assert_allclose(ours[name], theirs[name], rtol=1e-10, err_msg=str(name))
    # Similar names do not affect the description.
    assert made["static_slope"].attrs["long_name"] == "static slope"
    assert read_quantities_not_in_vocabulary(made)["static_slope"].scale == "D_c/V_*"
    assert ours["zeta_misfit"].attrs["units"] == "s"


def test_a_slope_is_told_in_units_of_the_rig_beside_its_name():
    with_units = (InUnits("slope_in_min", "static_slope", units="min"),)
    made = apply_reductions(lattice(), (LinearFit("static_slope", OF, on="number"), *with_units))
    expected = made["static_slope"] * 5.0 / 60.0  # D_c/V_* is 5 s.
    np.testing.assert_allclose(made["slope_in_min"], expected, rtol=1e-14)


def test_a_law_that_holds_a_number_stays_one_of_numbers():
    """A fit with a dimensionless offset has a dimensionless result.

    An example is V_0/V_* = 1 + zeta a/(b - a).
    """
    made = apply_reductions(lattice(), (ProportionalFit("zeta", OF, on="number", intercept=1.0),))
    assert "scale" not in made["zeta"].attrs | made["zeta_misfit"].attrs
    np.testing.assert_array_equal(convert_to_display_units(made)["zeta"], made["zeta"])


@pytest.mark.parametrize(
    ("kind", "across"),
    [
        (Difference("r", OF, along="law", reference="slip"), "law"),
        (RelativeDifference("r", OF, along="law", reference="slip"), "law"),
        (LinearFit("r", OF, on="number"), "x"),
        (Range("r", OF, over="x"), "x"),
    ],
    ids=lambda value: getattr(value, "kind", value),
)
def test_cells_of_several_scales_make_a_number_that_says_so(kind, across):
    sizes = np.linspace(1e-5, 2e-5, {"law": 2, "x": X.size}[across])
    scales = {
        "slip_distance": (across, sizes, {"units": "m"}),
        "reference_rate": (across, 2e-6 / sizes, {"units": "s-1"}),
    }
    made = apply_reductions(lattice(**scales), (kind,))
    assert "scale" not in made["r"].attrs
    assert (
        made["r"]
        .attrs["comment"]
        .endswith("; combines cells in units of D_c, which varies between the cells")
    )
    np.testing.assert_array_equal(convert_to_display_units(made)["r"], made["r"])
    # Along the other dimension, each result has a single scale.
    other = {"law": "x", "x": "law"}[across]
    kept = Range("r", OF, over=other) if other == "x" else Difference("r", OF, "law", "slip")
    assert apply_reductions(lattice(**scales), (kept,))["r"].attrs["scale"] == "D_c/V_*"


def test_tables_tell_them():
    rig = Rig(
        normal_stress="5 MPa", slip_distance="10 um", reference_velocity="1 um/s",
        stiffness="0.01 MPa/um",
    )  # fmt: skip
    fields = {"law": "slip", "normal_stress": "variable", "alpha": 0.5, "a": 0.01, "b_over_a": 1.4}
    fits = (
        LinearFit("static_slope", "critical_stiffness", on="load_velocity_ratio"),
        SemilogFit("per_decade", "critical_stiffness", on="load_velocity_ratio"),
    )
    axis, base = rig.axis("load_velocity", "1:100:3:log um/s"), rig.scene(**fields)
    of_rig = run(study_of("of", LinearStability(), axis, base=base, rig=rig, reductions=fits))
    slope, decade = (
        list(table.rows[0]) for table in reduction_tables.build_reduction_tables(of_rig)
    )
    assert slope[0] == "static_slope (MPa/um/(um/s))"
    assert slope[2] == "largest misfit (MPa/um)"
    assert decade[:2] == ["per_decade (MPa/um)", "standard error"]
    assert any(
        line.endswith(" MPa/um") for line in lattice_tables.summarise_study_as_text_lines(of_rig)
    )
