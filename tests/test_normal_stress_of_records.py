"""Tests of fits of records with variable normal stress.

The normal stress differs between steps, or changes within a window.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import synthetic_records as synthetic
from synthetic_records import EXACT_PARAMETERS, STEP_UP, deviation_in_stderrs

import rsfstudy
from rsfstudy.errors import InvalidValue
from rsfstudy.fitting.record import Record
from rsfstudy.status import Status

#: Stiffness of the machine in MPa/um, equal to the true stiffness at 8 MPa.
MACHINE = 8.0 * EXACT_PARAMETERS["stiffness"]
OPTIONS: dict[str, Any] = {
    "laws": ["slowness"],
    "stiffness": f"{MACHINE} MPa/um",
    "slip_distance": 8.0,
    "noise": "ar1",
    "engine": "compiled",
}


def record_at(stress: float, seed: int, name: str, later: float | None = None) -> Record:
    """Return a record of a velocity step at a normal stress in MPa.

    If ``later`` is given, the normal stress changes to this value 60 um after the step, when
    friction is steady. Friction stays constant, so the fit depends on the normal stress
    within the window only.
    """
    times = synthetic.sample_times(STEP_UP, 52.0, 400)
    moved = synthetic.load_point_displacement(STEP_UP, times)
    truth = EXACT_PARAMETERS | {"stiffness": MACHINE / stress}
    friction = synthetic.friction_and_sensitivities("slowness", times, STEP_UP, truth)[0]
    friction += synthetic.correlated_noise(len(times), 0.5, 1e-4, seed)
    sigma = np.where(moved > 100.0, later or stress, stress)
    columns = {"time": times, "displacement": moved, "friction": friction, "normal_stress": sigma}
    return rsfstudy.read_record(columns, name=name).with_steps([(40.0, 40.0, 1.0, 10.0)])


def test_stiffness_is_over_the_normal_stress_before_the_step() -> None:
    record = record_at(8.0, 1, "rising", later=24.0)
    fit = rsfstudy.fit(record, **OPTIONS, after="58 um").squeeze()
    ratio = OPTIONS | {"stiffness": EXACT_PARAMETERS["stiffness"]}
    stated = rsfstudy.fit(record, **ratio, after="58 um").squeeze()
    for name in ("a", "b", "slip_distance"):
        assert abs(deviation_in_stderrs(fit.squeeze(), name, EXACT_PARAMETERS[name])) < 3.5, name
        assert float(fit[name]) == pytest.approx(float(stated[name]), rel=1e-9)
    (row,) = fit.rsf.fit_table().to_dict("records")
    assert row["normal_stress"] == pytest.approx(8.0)
    assert row["k"] == pytest.approx(EXACT_PARAMETERS["stiffness"])
    slider = fit.rsf.scene
    assert slider.stiffness == pytest.approx(
        EXACT_PARAMETERS["stiffness"] * float(fit.slip_distance)
    )


@pytest.mark.parametrize("turned", [False, True])
def test_each_record_of_a_list_has_its_own_normal_stress(turned: bool) -> None:
    records = [record_at(8.0, 1, "low"), record_at(24.0, 2, "high")][:: -1 if turned else 1]
    fit = rsfstudy.fit(records, **OPTIONS)
    for name in ("a", "b", "slip_distance"):
        assert (np.abs(off_each(fit, name)) < 3.5).all(), name
    k = fit.rsf.fit_table().set_index("record")["k"]
    assert k["low"] == pytest.approx(EXACT_PARAMETERS["stiffness"])
    assert k["high"] == pytest.approx(EXACT_PARAMETERS["stiffness"] / 3.0)


def off_each(fit: Any, name: str) -> np.ndarray:
    return np.asarray((fit[name] - EXACT_PARAMETERS[name]) / fit[f"{name}_stderr"])


def test_steps_of_a_joint_fit_have_their_own_normal_stress() -> None:
    records = [record_at(24.0, 2, "high"), record_at(8.0, 1, "low")]
    fit = rsfstudy.fit(records, **OPTIONS, together=True)
    for name in ("a", "b", "slip_distance"):
        assert abs(deviation_in_stderrs(fit.squeeze(), name, EXACT_PARAMETERS[name])) < 3.5, name
    (row,) = fit.rsf.fit_table().to_dict("records")
    assert (row["normal_stress_1"], row["normal_stress_2"]) == pytest.approx((24.0, 8.0))
    assert row["k"] == pytest.approx(EXACT_PARAMETERS["stiffness"] / 3.0)


def test_a_free_stiffness_of_a_joint_fit_is_that_of_one_machine() -> None:
    records = [record_at(8.0, 1, "low"), record_at(24.0, 2, "high")]
    free = ("a", "b", "slip_distance", "mu_star", "stiffness")
    fit = rsfstudy.fit(records, **OPTIONS | {"stiffness": 2e-3}, free=free, together=True)
    for name in ("a", "slip_distance", "stiffness"):
        assert abs(deviation_in_stderrs(fit.squeeze(), name, EXACT_PARAMETERS[name])) < 3.5, name


def test_a_normal_stress_that_varies_within_the_window_is_refused() -> None:
    record = record_at(8.0, 1, "rising", later=8.4)
    fit = rsfstudy.fit(record, **OPTIONS).squeeze()
    assert Status.labels_by_code()[int(fit.status)] == "not_applicable"
    assert "normal stress varies from 8 to 8.4 MPa" in str(fit.message.values)
    assert "after=" in str(fit.message.values)


def test_noise_of_normal_stress_is_no_change() -> None:
    record = record_at(8.0, 1, "noisy")
    sigma = record.columns["normal_stress"]
    sigma = sigma * (1.0 + synthetic.correlated_noise(len(sigma), 0.0, 0.02, 3))
    noisy = rsfstudy.read_record(
        {**record.columns, "normal_stress": 1e-6 * sigma}, name="noisy"
    ).with_steps([(40.0, 40.0, 1.0, 10.0)])
    fit = rsfstudy.fit(noisy, **OPTIONS).squeeze()
    assert Status.labels_by_code()[int(fit.status)] == "ok"


def test_a_normal_stress_that_is_not_compressive_is_refused() -> None:
    record = record_at(8.0, 1, "negative")
    columns = {**record.columns, "normal_stress": -1e-6 * record.columns["normal_stress"]}
    negative = rsfstudy.read_record(columns).with_steps([(40.0, 40.0, 1.0, 10.0)])
    with pytest.raises(
        InvalidValue,
        match=r"normal_stress must be positive before step 1.*-8000000.*reverse the sign",
    ):
        rsfstudy.fit(negative, **OPTIONS)
