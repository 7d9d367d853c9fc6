"""Tests of records as loading.

Samples are followed exactly, in any partition. Errors of invalid records contain the
position of the problem.
"""

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from extensions.order_four import OrderFour
from study_runs import run, run_command, study_of

import rsfstudy
from rsfstudy import (
    Axis,
    Rig,
    Scene,
    history,
    protocol,
    read_protocol,
    read_table,
    simulate,
)
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.motion import engines
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED, ENGINE_NAMES
from rsfstudy.motion.integrator import Integrator
from rsfstudy.responses.step_response import StepResponse

PLAIN = {"normal_stress": "constant", "stiffness": 0.02, "a": 0.01, "b_over_a": 1.4}
SLIDERS = {
    "plain": {"law": "slip"},
    "mass": {"law": "slowness", "inertia": True, "period": 1e7, "stiffness": 0.003},
    "damping": {"law": "slip", "radiation_damping": 1e-4, "stiffness": 0.003},
    "dilatant": {"law": "slowness", "fluid": "dilatant"},
}
TIMES = np.array([5.0, 12.0, 20.0])
WHAT = ["shear_stress", "log10_slip_rate", "state_variable", "slip"]


def told(loading, slider="plain", engine=COMPILED, rtol=1e-8, **fields):
    scene = Scene(**PLAIN | SLIDERS.get(slider, {}) | fields, loading=loading)
    motion = simulate(scene, times=TIMES, rtol=rtol, engine=engine)
    return np.array([motion[name].values for name in WHAT])


def wave(samples, period=4.0):
    time = np.linspace(0.0, 20.0, samples)
    return {"time": time, "displacement": time + 0.4 * np.sin(2.0 * np.pi * time / period)}


@pytest.mark.parametrize("engine", ENGINE_NAMES)
@pytest.mark.parametrize("slider", SLIDERS)
def test_steps_as_a_history_tell_what_the_steps_do(slider, engine):
    steps = protocol([{"velocity": 3.0, "duration": 5.5}, {"velocity": 0.5, "duration": 8.0},
                      {"velocity": 2.0}])  # fmt: skip
    record = {"time": [0.0, 5.5, 13.5, 21.0], "displacement": [0.0, 16.5, 20.5, 35.5]}
    known = told(steps, slider, rtol=1e-9)
    np.testing.assert_allclose(told(history(record), slider, engine), known, atol=3e-7, rtol=0.0)


@pytest.mark.parametrize("slider", SLIDERS)
def test_finer_samples_where_it_is_linear_change_nothing(slider):
    """Additional samples on linear segments change nothing.

    Each additional sample begins a new step.
    """
    record = wave(21)
    finer = np.union1d(record["time"], np.linspace(0.0, 20.0, 102))
    between = {"time": finer, "displacement": np.interp(finer, *record.values())}
    known = told(history(record), slider)
    np.testing.assert_allclose(told(history(between), slider), known, atol=3e-7, rtol=0.0)


@pytest.mark.parametrize("engine", ENGINE_NAMES)
def test_sampled_normal_stress_is_a_ramp(engine):
    fields = {"normal_stress": "variable", "phi": 70.0}
    ramp = Scene(**PLAIN | fields, normal_stress_ramp=-0.2, ramp_duration=8.0)
    known = simulate(ramp, times=TIMES, rtol=1e-9, engine=COMPILED)
    for column, values in (("normal_stress", [1.0, 0.9, 0.8, 0.8]),
                           ("pore_pressure", [0.0, 0.1, 0.2, 0.2])):  # fmt: skip
        record = history({"time": [0.0, 4.0, 8.0, 21.0], column: values})
        found = told(record, engine=engine, **fields)
        for name, numbers in zip(WHAT, found, strict=True):
            # Slip accumulates an error of 1e-8 of ln V over the whole time.
            np.testing.assert_allclose(numbers, known[name], atol=3e-7)


def test_a_step_of_normal_stress_at_the_first_sample_is_one():
    fields = {"normal_stress": "imposed"}
    stepped = Scene(**PLAIN | fields, normal_stress_step=0.1, load_velocity_ratio=1.0)
    known = simulate(stepped, times=TIMES, rtol=1e-9, engine=COMPILED)
    found = told(history({"time": [0.0, 30.0], "normal_stress": [1.1, 1.1]}), **fields)
    for name, numbers in zip(WHAT, found, strict=True):
        np.testing.assert_allclose(numbers, known[name], atol=1e-7)


@pytest.mark.parametrize("engine", ENGINE_NAMES)
def test_a_sample_costs_one_step(engine):
    """A sample costs about 13 evaluations, which is a single step.

    The motion itself needs few steps.
    """
    work = []
    for samples in (400, 800):
        scene = Scene(**PLAIN, loading=history(wave(samples, period=40.0)))
        work.append(simulate(scene, times=[20.0], engine=engine).attrs["rhs_evaluations"])
    assert work[1] - work[0] < 15 * 400


def test_units_of_a_rig(tmp_path):
    rig = Rig(normal_stress="5 MPa", slip_distance="10 um", reference_velocity="1 um/s")
    record = wave(30)
    known = history(record)
    file = tmp_path / "record.csv"
    rows = [f"{10.0 * t:.17g},{10.0 * d:.17g}" for t, d in zip(*record.values(), strict=True)]
    file.write_text("\n".join(["time (s), displacement (um)", *rows]))
    read = history(file, rig)
    np.testing.assert_allclose(read.sample_table, known.sample_table, rtol=1e-11, atol=1e-12)
    file.write_text("\n".join(["t, LVDT", *rows]))
    columns = {"time": ("t", "s"), "displacement": ("LVDT", "um")}
    assert history(file, rig, columns=columns).digest == read.digest
    assert read_table(file, columns)["time"].units == "s"
    dataset = xr.Dataset(
        {"displacement": ("n", 10.0 * record["displacement"], {"units": "um"}),
         "time": ("n", 10.0 * record["time"], {"units": "s"})}
    )  # fmt: skip
    np.testing.assert_allclose(history(dataset, rig).sample_table, known.sample_table, atol=1e-11)
    with pytest.raises(InvalidValue, match="heading 'time' has no units"):
        history(dataset.assign(time=("n", record["time"])), rig)
    with pytest.raises(InvalidValue, match="units = .* require a rig to convert"):
        history(dataset)


def test_a_history_is_data():
    """Histories can be compared, copied and pickled.

    The digest identifies the samples.
    """
    one, same, other = history(wave(20)), history(wave(20)), history(wave(30), name="finer")
    assert one == same != other
    assert pickle.loads(pickle.dumps(one)) == copy.deepcopy(one) == one
    assert one.digest in repr(one)
    assert len(repr(one)) < 120


def test_a_motion_holds_its_samples(tmp_path):
    """The file of a motion contains the samples of its history.

    Histories with equal names are distinguished, and modified samples are rejected.
    """
    scene = Scene(**PLAIN, loading=history(wave(20)))
    file = tmp_path / "motion.nc"
    simulate(scene, duration=2.0, engine=COMPILED).to_netcdf(file)
    Scene(**PLAIN, loading=history(wave(30)))
    motion = xr.load_dataset(file)
    assert motion.history_samples.dims == ("history_sample", "history_column")
    assert motion.rsf.scene == scene
    motion["history_samples"] = 2.0 * motion.history_samples
    with pytest.raises(DataError, match="history_samples do not match the digest of the scene"):
        _ = motion.rsf.scene


def test_results_hold_the_loadings_of_their_study(tmp_path):
    """Results contain the records and protocols of their study.

    The study can be computed again without its study file. Histories with equal names are
    distinguished.
    """
    steps = protocol([{"velocity": 3.0, "duration": 5.0}, {"velocity": 0.5}], "steps")
    record = history(wave(20))
    study = study_of(
        "records",
        StepResponse(peaks=2, phases=2),
        Axis("loading", [record, steps]),
        base=Scene(**PLAIN),
    )
    run(study, rtol=1e-4, output=tmp_path, engine=COMPILED)
    Scene(**PLAIN, loading=history(wave(30)))
    results = rsfstudy.open(tmp_path / "records.nc")
    assert results.history_samples.dims == ("history_sample", "history_column")
    assert [scene.parts.loading for scene in results.rsf.study.scenes()] == [record, steps]
    table = rsfstudy.rerun(tmp_path / "records.nc", workers=0, progress=False)
    assert not table.attrs["differs"]
    assert table["identical"].dropna().equals(table["values"][table["identical"].notna()])
    with pytest.raises(
        DataError, match="history_samples is not the table of a loading with 4 columns"
    ):
        results.isel(history_column=slice(3)).rsf.study  # noqa: B018


def test_the_command_line_follows_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows = [f"{t:.17g},{d:.17g}" for t, d in zip(*wave(20).values(), strict=True)]
    Path("record.csv").write_text("\n".join(["time (D_c/V_*), displacement (D_c)", *rows]))
    words = [f"--set={name}={value}" for name, value in PLAIN.items()]
    for told in (["--set", "loading=record.csv"], ["--protocol", "record.csv"]):
        status, said = run_command(["simulate", *words, *told, "--rtol", "1e-4"])
        assert status == 0, said
        motion = xr.load_dataset("motion.nc")
        assert motion.rsf.scene.parts.loading == history(wave(20), name="record")
    status, said = run_command(["simulate", "--set", "loading=absent.csv"])
    assert status == 1
    assert "the file absent.csv does not exist" in said


def test_the_files_that_ship_are_followed():
    """The protocol and the record of the documentation are valid loadings."""
    pages = Path(__file__).parent.parent / "studies" / "pages"
    rig = Rig(
        normal_stress="5 MPa", slip_distance="10 um", reference_velocity="1 um/s",
        stiffness="0.05 MPa/um",
    )  # fmt: skip
    for loading, lasts in (
        (history(pages / "record.csv", rig), 300.0),
        (read_protocol(pages / "protocol.csv", rig), 1130.0),
    ):
        scene = rig.scene(law="slowness", normal_stress="imposed", loading=loading)
        motion = rig.in_units(simulate(scene, rtol=1e-4, engine=COMPILED))
        assert float(motion.time[-1]) == pytest.approx(lasts)


# Other modules load the file of this stepper as a study file, which defines the name with
# another class.
engines._USER_STEPPER_CLASS_BY_NAME.pop(OrderFour.name)


class Followed(OrderFour):
    name = "order_four_along_records"


@pytest.mark.parametrize("method", ["Radau", "LSODA", "RK45", Followed])
def test_other_steppers_follow_it_too(method):
    """Other steppers follow the samples too.

    Steppers that cannot end a step at a kink are restarted there.
    """
    scene = Scene(**PLAIN, law="slowness", loading=history(wave(12)))
    known = told(history(wave(12)), "", law="slowness")[0, -1]
    own = isinstance(method, type)
    options = {"engine": method} if own else {"methods": (("quasi_static", method),)}
    *_earlier, end = Integrator(Accuracy(1e-6, 10**6, **options)).follow(scene, until=20.0)
    assert scene.mu_star + end.point.spring_stress == pytest.approx(known, abs=1e-7)
