"""Contract of every named study found: it runs, its file stands alone, its figure is drawn, its
claims are sound.
"""

import json
import os
import re
import subprocess
import sys
import warnings
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from compliance_checker.runner import CheckSuite, ComplianceChecker
from running import named_results

import rsfstudy
from rsfstudy import Axis, plots, vocabulary
from rsfstudy.declare import catalogue
from rsfstudy.declare.study import Study
from rsfstudy.status import Status

FLAGS = {"status", "regime", "inertia"}


#: What is enough of a dear study for its verdicts: in that of costs, the integrators they turn on;
#: in that of error estimates, a scene of each kind.
ENOUGH = {
    "accuracy_cost": {
        "integrator": ["DOP853", "RK45", "DOP853 + Radau", "Radau (mass always)"],
        "requested_digits": [4, 6, 8, 9],
        "repeats": 1,
    },
    "coverage": {"sample": [0]},
    "bounded_slip": {"load_velocity_ratio": [2.0, 20.0, 200.0]},
    "stress_drop": {"stiffness_ratio": [0.4, 0.8]},
}


def declared(name: str) -> Study:
    """The study, or enough of it: other axes, but the study as declared, with all its claims."""
    study, fewer = catalogue.load(name), ENOUGH.get(name, {})
    axes = [
        Axis(a.dimension, fewer[a.dimension]) if a.dimension in fewer else a for a in study.axes
    ]
    repeats = {k: v for k, v in fewer.items() if k == "repeats"}
    return replace(study, axes=axes, measure=study.measure.with_(**repeats))


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(name, marks=pytest.mark.xdist_group(name))  # one run serves all its tests
        for name in catalogue.names()
    ],
)
def result(request, tmp_path_factory, cluster):
    """The default lattice of each study, on two workers, and where its file is."""
    return named_results(declared(request.param), tmp_path_factory, cluster)


def test_the_study_is_named_as_its_file(result):
    dataset, path = result
    assert catalogue.load(path.stem).name == path.stem == dataset.attrs["id"]


def test_every_cell_is_answered(result):
    dataset, _path = result
    assert (dataset.status < int(Status.WORK_BUDGET_SPENT)).all()
    assert dataset.attrs["completeness"] == "complete"


def test_every_verdict_is_the_expected_one(result):
    table = rsfstudy.check(result[0])
    assert len(table) == len(catalogue.load(result[1].stem).claims)
    assert not table.moved.any(), table.to_string()
    assert not (table.verdict == "not applicable").any()


def test_the_file_stands_alone(result):
    """Opened without rsfstudy, it shows units and long names on every variable, and where it comes
    from.
    """
    script = (
        "import sys, json, xarray; d = xarray.open_dataset(sys.argv[1]); "
        "assert 'rsfstudy' not in sys.modules; "
        "print(json.dumps({n: dict(long_name=v.attrs.get('long_name'), units=v.attrs.get('units'), "
        "kind=v.dtype.kind) for n, v in d.variables.items()}))"
    )
    found = subprocess.run(
        [sys.executable, "-c", script, str(result[1])],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONWARNINGS": "ignore"},
    )
    for name, about in json.loads(found.stdout).items():
        assert about["long_name"], name
        text = about["kind"] in "OUST" or name in FLAGS
        assert bool(about["units"]) is not text, name


#: ACDD attributes without a meaning for a slider that is nowhere and at no time, publishes nothing
#: and has quantities that no standard names exist for.
MEANINGLESS = re.compile(
    "geospatial_|time_coverage_|publisher_|creator_url|standard_name|acknowledgment/"
)


def test_the_compliance_checker_reports_no_error(result, tmp_path):
    """And no attribute for discovery is missing that has a meaning here."""
    report = tmp_path / "report.json"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the checker's own
        CheckSuite.load_all_available_checkers()
        ComplianceChecker.run_checker(
            str(result[1]),
            ["cf:1.11", "acdd:1.3"],
            0,
            "normal",
            output_filename=str(report),
            output_format="json",
        )
    found = json.loads(report.read_text())
    assert [part["msgs"] for part in found["cf:1.11"]["high_priorities"] if part["msgs"]] == []
    missing = [
        message
        for priority in ("high_priorities", "medium_priorities")
        for part in found["acdd:1.3"][priority]
        for message in part["msgs"]
    ]
    assert [message for message in missing if not MEANINGLESS.search(message)] == []


def test_the_declaration_in_the_file_is_the_study(result):
    found = json.loads(result[0].attrs["declaration"])
    described = declared(result[1].stem).describe()
    assert found == json.loads(json.dumps(described))


def test_every_number_carries_status_error_and_work(result):
    dataset, _path = result
    headline = catalogue.load(result[1].stem).measure.headline
    for name in (headline, f"{headline}_error", "status", "rhs_evaluations", "wall_time"):
        assert name in dataset
    ok = dataset.status == int(Status.OK)
    assert dataset[f"{headline}_error"].where(ok, 0.0).notnull().all()
    assert "status" in dataset[headline].attrs["ancillary_variables"]


def test_the_figure_is_drawn(result, tmp_path):
    dataset, _path = result
    figure = plots.figure(dataset)
    for axes in figure.axes:
        assert axes.get_xlabel()
        assert axes.get_ylabel()
    plots.save(dataset, tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 10_000


def test_a_partial_figure_says_so(result):
    dataset = result[0].assign_attrs(completeness="partial: 1 of 2 cells")
    assert "partial: 1 of 2" in plots.figure(dataset).axes[0].get_title()


def test_a_plot_outside_of_the_package_is_never_imported(result):
    foreign = json.loads(result[0].attrs["declaration"])
    foreign["plot"] = "os"
    dataset = result[0].assign_attrs(declaration=json.dumps(foreign))
    with pytest.raises(rsfstudy.errors.InvalidValue, match="plot = 'os': is unknown"):
        plots.figure(dataset)


def test_the_plain_plot_draws_any_lattice(result):
    foreign = json.loads(result[0].attrs["declaration"])
    foreign["plot"] = "lines"
    figure = plots.figure(result[0].assign_attrs(declaration=json.dumps(foreign)))
    assert figure.axes[0].lines


def test_vocabulary_describes_itself():
    for name, quantity in vocabulary.QUANTITIES.items():
        assert quantity.name == name
        assert quantity.long_name
        assert quantity.axis_label
    error = vocabulary.quantity("critical_displacement_error")
    assert error.long_name.startswith("numerical error estimate of critical load point")
    assert error.scale == "D_c"


def rate_step_boundary() -> xr.Dataset:
    return rsfstudy.run("rate_step_boundary", workers=0, output=None, progress=False)


def test_rate_step_boundary_is_figure_5():
    dataset = rate_step_boundary()
    assert set(dataset.critical_velocity_ratio.dims) == {"case", "b_over_a"}
    held = {0.25, 0.5, 1.0, 2.0, 4.0}
    assert all(np.isclose(dataset.a_over_b_minus_a, x, rtol=1e-12).any() for x in held)
    zeta = {str(case): float(dataset.zeta.sel(case=case)) for case in dataset.case.values}
    assert zeta["constant normal stress"] == pytest.approx(1.0, abs=1e-4)
    assert zeta["alpha = 0.25"] == pytest.approx(0.84, abs=0.01)
    assert zeta["alpha = 0.56"] == pytest.approx(0.664, abs=0.01)
    assert (dataset.zeta_stderr < 0.003).all()
    # at a/(b-a) = 4 the finite norm bends even the constant-stress curve: 4.66 instead of 5
    bent = dataset.critical_velocity_ratio.sel(case="constant normal stress").isel(b_over_a=-1)
    assert float(bent) == pytest.approx(4.66, abs=0.005)
    assert int(dataset.rhs_evaluations.max()) <= 8_000


def test_the_plain_lattice_agrees_with_the_critical_steps_within_its_bracket():
    """Cells followed forward in time against critical paths followed back, for every row."""
    rows = {"stiffness_ratio": [1.0, 1.5, 2.0]}
    run = {"workers": 0, "output": None, "progress": False}
    cells = rsfstudy.run("rate_step_lattice", **rows, **run)
    steps = rsfstudy.run("rate_step_stiffness", law="slip", **rows, **run)
    critical = steps.critical_velocity_ratio.squeeze("law", drop=True)
    assert critical.sizes == cells.lattice_boundary.sizes
    assert (cells.lattice_boundary_stable < critical).all()
    assert (critical < cells.lattice_boundary_unstable).all()


def test_other_angles_of_the_limit_cycles():
    dataset = rsfstudy.run(
        "limit_cycles", phi=[50, 60], law="slip", workers=0, output=None, progress=False
    )
    variable = dataset.sel(normal_stress="variable").squeeze("law")
    assert (variable.static_stress_drop.diff("phi") < 0.0).all()
    assert len(plots.figure(dataset).axes) == 4
