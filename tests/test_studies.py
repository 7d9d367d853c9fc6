"""Tests of all named studies.

Each study runs, its file can be used without rsfstudy, its figure can be drawn, and its
claims are sound.
"""

import functools
import json
import re
import subprocess
import sys
import warnings
from dataclasses import replace

import numpy as np
import pytest
from compliance_checker.cf import util as cfutil
from compliance_checker.runner import CheckSuite, ComplianceChecker
from study_runs import named_results, reduced_study

import rsfstudy
from rsfstudy import plots
from rsfstudy.status import Status
from rsfstudy.study import named_study_index, study_loader

FLAGS = {"slip_mode", "status", "regime", "inertia", "regularised"}


@pytest.fixture(scope="module", params=named_study_index.list_study_names())
def result(request, tmp_path_factory):
    """Return the results of a reduced study, and the path of its file."""
    return named_results(request.param, tmp_path_factory)


def test_the_study_is_named_as_its_file(result):
    dataset, path = result
    assert study_loader.load_study(path.stem).name == path.stem == dataset.attrs["id"]


def test_every_cell_is_answered(result):
    dataset, _path = result
    assert (dataset.status < int(Status.WORK_BUDGET_SPENT)).all()
    assert dataset.attrs["completeness"] == "complete"


def test_every_verdict_is_the_expected_one(result):
    table = rsfstudy.check(result[0])
    assert len(table) == len(reduced_study(result[1].stem).claims)
    assert not table.verdict_changed.any(), table.to_string()
    assert not (table.verdict == "not applicable").any()


#: Claims with a tolerance larger than ``called_for``, and the reasons.
WIDE = {
    "accuracy_cost A1": "the range allows users to predict the error from the tolerance",
    "coverage T3": "the tolerance is two standard errors of a median",
    "design_of_steps D1": "the published result does not state the number of rows before the step",
    "design_of_steps D2": "sampling error of a standard deviation",
    "dilatancy D1": "the expected value has eight decimals",
    "dilatancy D3": "the truncation error of finite differences varies between the points",
    "displacement_boundary C10": "the paper says 'a few percents'",
    "flash_heating H2": "the truncation error of finite differences varies between the points",
    "fit_coverage F1": "the tolerance is a number of binomial standard deviations",
    "fit_coverage F2": "the tolerance is a number of binomial standard deviations",
    "fit_coverage_joint J1": "the tolerance is a number of binomial standard deviations",
    "fit_coverage_joint J2": "the tolerance is a number of binomial standard deviations",
    "injection I1": "a common bound for all cases: the pressure change within 2 D_c/V_*",
    "laboratory_recurrence L1": "read from a figure, and the event times are ambiguous",
    "laboratory_recurrence L3": "reading error of a figure, and sampling errors",
    "law_identification I1": "the expected value has two digits",
    "law_identification I2": "sampling error of a standard deviation",
    "laws L1": "the truncation error of finite differences is smaller for nearly linear laws",
    "laws_cycles L10": "the paper reports an integer multiple",
    "linear_stability C1": "the truncation error of finite differences varies between the points",
    "normal_stress_steps R5": "a fifth of the first order; the second order may vanish",
    "normal_stress_steps R6": "a common second-order bound for all steps and both laws",
    "rigid_response C5": "the paper gives one decimal",
    "slide_hold_slide P1": "the tolerance is the requested accuracy relative to a",
    "slide_hold_slide P2": "a common bound; the neglected terms decrease with stiffness",
    "slide_hold_slide P3": "3 of 100 peaks have this error, depending on the integration steps",
    "slide_hold_slide P4": "a common bound; the neglected terms decrease as 1/k",
    "stability_map C1": "the tolerance is half of the bracket that contains the boundary",
    "wave_triggering W1": "a common second-order bound; the term almost vanishes for slow waves",
    "stress_drop C15": "the paper reports integer multiples",
    "thermal_pressurisation H11": "truncation error of finite differences",
    "thermal_pressurisation_step H15": "a common first-order bound for all slips",
    "uncertain_recurrence U1": "the sampling error depends on the seed",
    "what_matters W3": "the sampling error depends on the seed",
}


def called_for(claim, study, dataset) -> float:
    """Return the largest justified tolerance of a claim.

    The tolerance is the maximum of ten times the difference, ten times the numerical error,
    the requested accuracy, and the rounding error.
    """
    second = claim.baseline_variable or claim.variable
    places = [
        (claim.variable, claim.where),
        *([(second, claim.baseline)] if claim.baseline else []),
    ]
    errors = [
        replace(claim, variable=f"{name}_error", where=where, baseline={}).verdict(dataset)[0]
        for name, where in places
    ]
    return max(
        10.0 * abs(claim.verdict(dataset)[0] - claim.published),
        10.0 * float(np.nansum(errors)),  # The error is NaN if there is no estimate.
        study.accuracy.rtol * abs(claim.published),
        16.0 * sys.float_info.epsilon * max(1.0, abs(claim.published)),
    )


def test_claims_could_fail(result):
    """A claim with an unnecessarily large tolerance has a reason.

    The reasons are listed in ``WIDE``.
    """
    study = reduced_study(result[1].stem)
    for claim in study.claims:
        named = f"{study.name} {claim.id}"
        most = called_for(claim, study, result[0])
        excess = f"{named}, {claim.statement}: {claim.tolerance:g} exceeds {most:g}"
        assert claim.tolerance <= most or named in WIDE, excess


#: Source of a process that opens files with xarray in an environment without rsfstudy.
_READER = """
import json, sys, warnings
import xarray

warnings.simplefilter("ignore")
sys.modules["rsfstudy"] = None
for line in sys.stdin:
    with xarray.open_dataset(line.strip()) as dataset:
        assert not hasattr(dataset, "rsf")
        about = {
            name: {
                "long_name": values.attrs.get("long_name"),
                "units": values.attrs.get("units"),
                "kind": values.dtype.kind,
            }
            for name, values in dataset.variables.items()
        }
    print(json.dumps(about), flush=True)
"""


@pytest.fixture(scope="module")
def reader():
    """Start a process that can import xarray, but not rsfstudy."""
    with subprocess.Popen(
        [sys.executable, "-c", _READER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        yield process
        process.stdin.close()


def test_the_file_stands_alone(result, reader):
    """Without rsfstudy, each variable has units and a long name."""
    print(result[1], file=reader.stdin, flush=True)
    for name, about in json.loads(reader.stdout.readline()).items():
        assert about["long_name"], name
        text = about["kind"] in "OUST" or name in FLAGS
        assert bool(about["units"]) is not text, name


#: ACDD attributes that do not apply, because a slider has no position and no date, publishes
#: nothing, and has quantities without standard names.
MEANINGLESS = re.compile(
    "geospatial_|time_coverage_|publisher_|creator_url|standard_name|acknowledgment/"
)


@pytest.fixture(scope="module")
def checkers():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Warnings of the checkers.
        CheckSuite.load_all_available_checkers()


def test_the_compliance_checker_reports_no_error(result, tmp_path, monkeypatch, checkers):
    """The file follows the CF conventions.

    All applicable discovery attributes are present.
    """
    report = tmp_path / "report.json"
    # The checker calls these functions a thousand times for the same file.
    for name in ("get_geophysical_variables", "get_auxiliary_coordinate_variables"):
        monkeypatch.setattr(cfutil, name, functools.cache(getattr(cfutil, name)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Warnings of the checker.
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
    described = reduced_study(result[1].stem).describe()
    assert found == json.loads(json.dumps(described))


def test_every_number_carries_status_error_and_work(result):
    dataset, _path = result
    headline = study_loader.load_study(result[1].stem).measure.primary_output
    for name in (headline, f"{headline}_error", "status", "rhs_evaluations", "wall_time"):
        assert name in dataset
    ok = dataset.status == int(Status.OK)
    assert dataset[f"{headline}_error"].where(ok, 0.0).notnull().all()
    assert "status" in dataset[headline].attrs["ancillary_variables"]


def test_what_is_reduced_carries_the_errors_of_its_cells(result):
    """A reduced value has an error if its variable has errors."""
    dataset, path = result
    for reduction in study_loader.load_study(path.stem).reductions:
        if reduction.name not in dataset or f"{reduction.of}_error" not in dataset:
            continue
        if reduction.uses_failed_cells:  # The result counts statuses.
            continue
        error = dataset[f"{reduction.name}_error"]
        assert (error >= 0.0).where(dataset[reduction.name].notnull(), True).all(), reduction.name


@pytest.mark.parametrize(
    "result", named_study_index.list_study_names()[::7], indirect=True, scope="module"
)
def test_the_plain_plot_draws_any_lattice(result):
    foreign = json.loads(result[0].attrs["declaration"])
    foreign["plot"] = "lines"
    figure = plots.draw_figure(result[0].assign_attrs(declaration=json.dumps(foreign)))
    assert figure.axes[0].has_data()


def test_the_plain_lattice_agrees_with_the_critical_steps_within_its_bracket(tmp_path_factory):
    """Forward motions agree with critical paths for every row."""
    cells, _path = named_results("rate_step_lattice", tmp_path_factory)
    steps, _path = named_results("rate_step_stiffness", tmp_path_factory)
    critical = steps.critical_velocity_ratio.sel(
        law="slip", stiffness_ratio=cells.stiffness_ratio, drop=True
    )
    assert critical.sizes == cells.lattice_boundary.sizes
    assert (cells.lattice_boundary_stable < critical).all()
    assert (critical < cells.lattice_boundary_unstable).all()
