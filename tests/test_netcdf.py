"""Tests of the datasets that public functions return.

Each dataset can be written by xarray without changes, is identical after reading, and
follows the CF conventions.
"""

import functools
import inspect
import json
import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from compliance_checker.cf import util as cfutil
from compliance_checker.runner import CheckSuite, ComplianceChecker
from scipy.stats import norm
from study_runs import study_of
from synthetic_records import SLIDE_HOLD_SLIDE, synthetic_record

import rsfstudy
from rsfstudy import Axis, Rig, Scene
from rsfstudy.api.accessor import Backend, DatasetAccessor
from rsfstudy.fitting.record import Record
from rsfstudy.reductions import ProportionalFit
from rsfstudy.responses.healing import Healing
from rsfstudy.responses.linear_stability import LinearStability

QUICK = {"rtol": 1e-3}
STEPPED = Scene(load_velocity_ratio=2.0, normal_stress="constant")
CYCLING = Scene(stiffness_ratio=0.8, normal_stress="constant", inertia=True)
RIG = Rig(
    normal_stress="5 MPa",
    stiffness="0.05 MPa/um",
    slip_distance="10 um",
    reference_velocity="1 um/s",
)
SCALES = {"normal_stress": 5e6, "slip_distance": 1e-5}
STABILITY = study_of(
    "stability",
    LinearStability(),
    Axis("case", {"constant": {"normal_stress": "constant"}, "coupled": {"alpha": 0.25}}),
    Axis("b_over_a", [1.5, 2.0, 3.0]),
    reductions=[ProportionalFit("slope", of="critical_stiffness", on="b_over_a")],
)
HEALING = study_of("healing", Healing(), Axis("hold_time", [10.0, 100.0]))
SAMPLED = study_of("sampled", LinearStability(), Axis.samples({"a": norm(0.01, 1e-4)}, 8))
OF_RIG = study_of(
    "of_rig",
    LinearStability(),
    RIG.axis("slip_distance", ["5 um", "10 um"]),
    base=RIG.scene(normal_stress="constant"),
    rig=RIG,
)


def run(study, **options):
    options = {"workers": 0, "output": None, "progress": False, **options}
    return rsfstudy.run(study, **options)


@functools.cache
def cycle() -> xr.Dataset:
    return rsfstudy.limit_cycle(CYCLING, **QUICK)


@functools.cache
def motion() -> xr.Dataset:
    return rsfstudy.simulate(STEPPED, duration=1.0, **QUICK)


@functools.cache
def fit() -> xr.Dataset:
    return rsfstudy.fit(synthetic_record(seed=1), laws=["slowness"], stiffness=3e-3, steps=[1])


def opened(place: Path, name: str = "stability", **options) -> xr.Dataset:
    run(STABILITY, output=place, **options)
    return rsfstudy.open(place / f"{name}.{'zarr' if options else 'nc'}")


def stick_slip() -> xr.Dataset:
    """Return a record of shear stress that drops ten times."""
    time = np.arange(2000.0)
    stress = np.interp(time % 200.0, [0.0, 195.0, 200.0], [0.0, 5e6, 0.0])
    return rsfstudy.events(
        time=time, shear_stress=stress + np.random.default_rng(1).normal(0.0, 1e4, time.size)
    )


def held_record() -> Record:
    return synthetic_record(SLIDE_HOLD_SLIDE, seed=1)


def held_motion() -> xr.Dataset:
    scene = Scene(normal_stress="constant", hold_time=10.0, stiffness_ratio=10.0)
    return rsfstudy.simulate(scene, duration=30.0, **QUICK)


def rig_motion(**units) -> xr.Dataset:
    pulled = rsfstudy.history({"time": [0.0, 1.0, 2.0], "displacement": [0.0, 1.0, 5.0]})
    scene = RIG.scene(law="slowness", a=0.01, b_over_a=1.4, loading=pulled)
    return RIG.in_units(rsfstudy.simulate(scene, **QUICK), **units)


#: Functions whose datasets have units for the labels of plots. CF does not know units like "D_c".
FOR_PLOTS_ONLY = {"DatasetAccessor.simplify"}
#: Datasets of each public function in all variants. Each function receives a directory.
MADE = {
    "simulate": lambda _: motion(),
    "simulate at times": lambda _: rsfstudy.simulate(STEPPED, times=[0.0, 1.0, 2.0], **QUICK),
    "simulate two states": lambda _: rsfstudy.simulate(
        Scene(law="two_slip_states", load_velocity_ratio=2.0), duration=1.0, **QUICK
    ),
    "simulate dilatant": lambda _: rsfstudy.simulate(
        Scene(fluid="dilatant", normal_stress="imposed", load_velocity_ratio=2.0),
        duration=1.0,
        **QUICK,
    ),
    "simulate beyond the norm": lambda _: rsfstudy.simulate(
        Scene(stiffness_ratio=0.5, load_velocity_ratio=30.0), duration=100.0, **QUICK
    ),
    "to_si": lambda _: rsfstudy.to_si(motion(), **SCALES),
    "DatasetAccessor.to_si": lambda _: cycle().rsf.to_si(**SCALES),
    "Rig.in_units": lambda _: rig_motion(stress="MPa", length="um"),
    "Rig.in_units in h": lambda _: rig_motion(time="h"),
    "critical_step": lambda _: rsfstudy.critical_step(STEPPED, **QUICK),
    "limit_cycle": lambda _: cycle(),
    "limit_cycle without one": lambda _: rsfstudy.limit_cycle(
        CYCLING.with_(stiffness_ratio=2.0), **QUICK
    ),
    "DatasetAccessor.events": lambda _: motion().rsf.events(slip_rate=1.5),
    "events": lambda _: stick_slip(),
    "run": lambda _: run(STABILITY),
    "run along phase": lambda _: run(HEALING, rtol=1e-3),
    "run of samples": lambda _: run(SAMPLED),
    "run of a rig": lambda _: run(OF_RIG),
    "run into a file": lambda place: run(STABILITY, output=place),
    "run into a store": lambda place: run(STABILITY, output=place, format="zarr"),
    "DatasetAccessor.in_units": lambda _: run(OF_RIG).rsf.in_units(),
    "open": opened,
    "open a store": lambda place: opened(place, format="zarr"),
    "Backend.open_dataset": lambda place: xr.open_dataset(
        opened(place).encoding.get("source", place / "stability.nc"), engine="rsfstudy"
    ),
    "fit": lambda _: fit(),
    "DatasetAccessor.sample_parameters": lambda _: fit().rsf.sample_parameters(5),
    "healing": lambda _: rsfstudy.healing(held_record()),
    "DatasetAccessor.holds": lambda _: held_motion().rsf.holds(),
    "Record.holds": lambda _: held_record().holds(),
    "Record.stiffness": lambda _: held_record().stiffness(),
    "Record.to_dataset": lambda _: synthetic_record(seed=1).to_dataset(),
    "Record.steps": lambda _: synthetic_record(seed=1).steps(),
}


#: Variants whose files equal the files of "run" and "open a store".
ALIKE = ("run into a file", "run into a store", "open", "Backend.open_dataset")


@functools.cache
def load_checkers() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Warnings of the checkers.
        CheckSuite.load_all_available_checkers()


def cf_errors(path: Path, monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """Return the errors that the CF checker reports for a file."""
    load_checkers()
    for name in ("get_geophysical_variables", "get_auxiliary_coordinate_variables"):
        monkeypatch.setattr(cfutil, name, functools.cache(getattr(cfutil, name)))
    report = path.with_suffix(".json")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        how = {"output_filename": str(report), "output_format": "json"}
        ComplianceChecker.run_checker(str(path), ["cf:1.11"], 0, "normal", **how)
    found = json.loads(report.read_text())["cf:1.11"]["high_priorities"]
    return {message for part in found for message in part["msgs"]}


#: The checker requires this attribute for every dimension called time, but then rejects units
#: without a date. The time since a step has no date.
ELAPSED = "Coordinate variable 'time' should have standard_name='time', found: 'None'"


@pytest.mark.filterwarnings("ignore::rsfstudy.errors.NoResultWarning", "ignore::UserWarning")
@pytest.mark.parametrize("name", MADE)
def test_any_dataset_is_written_as_it_is_and_follows_cf(name, tmp_path, monkeypatch):
    dataset, path = MADE[name](tmp_path / "results"), tmp_path / "written.nc"
    dataset.to_netcdf(path)
    with xr.open_dataset(path) as written:
        xr.testing.assert_identical(dataset.load(), written.load())
    if name not in ALIKE:  # The checker is slow.
        assert cf_errors(path, monkeypatch) - {ELAPSED} == set()


def test_every_public_function_that_returns_a_dataset_is_tried():
    owners = {"": rsfstudy, **{c.__name__: c for c in (DatasetAccessor, Backend, Rig, Record)}}
    names = {"": rsfstudy.__all__}

    def find(of, name):
        # Access to the former names of a class would raise a warning.
        return inspect.getattr_static(of, name) if inspect.isclass(of) else getattr(of, name)

    returning = {
        f"{owner}.{name}".lstrip(".")
        for owner, of in owners.items()
        for name in names.get(owner, [n for n, v in vars(of).items() if inspect.isfunction(v)])
        if not name.startswith("_")
        and inspect.isfunction(find(of, name))
        and "Dataset" in str(find(of, name).__annotations__.get("return", ""))
    }
    assert returning - {name.split(" ")[0] for name in MADE} == FOR_PLOTS_ONLY
    assert len(returning) > 12


def test_no_encoding_of_a_store_prevents_netcdf(tmp_path):
    """The encoding of a Zarr store does not prevent writing NetCDF files.

    Older versions of xarray cannot write the string dtype of Zarr stores.
    """
    stored = run(STABILITY, output=tmp_path, format="zarr")
    dtypes = [variable.encoding.get("dtype") for variable in stored.variables.values()]
    assert "T" not in [dtype.kind for dtype in dtypes if dtype is not None]


def test_xarray_opens_a_store_without_warnings(tmp_path):
    """The metadata are consolidated, as xarray expects."""
    stored = run(STABILITY, output=tmp_path, format="zarr")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        dataset = xr.open_zarr(tmp_path / "stability.zarr")
        assert set(dataset.variables) == set(stored.variables)
        assert stored.status.attrs["flag_values"].dtype == np.int8
