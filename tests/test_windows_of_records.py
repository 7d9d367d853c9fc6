"""Tests of the windows of steps, and of reports on shortened windows."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import synthetic_records as synthetic
from synthetic_records import EXACT_PARAMETERS, deviation_in_stderrs

import rsfstudy
from rsfstudy.errors import InvalidValue
from rsfstudy.fitting.linear_friction_before_step import find_start_of_linear_friction
from rsfstudy.fitting.record import Record
from rsfstudy.status import Status

LOADING = ((0.0, 2.0), (150.0, 20.0))
OPTIONS: dict[str, Any] = {
    "laws": ["slowness"],
    "stiffness": EXACT_PARAMETERS["stiffness"],
    "slip_distance": 8.0,
    "noise": "ar1",
    "engine": "compiled",
}


def run_in(seed: int = 1, depth: float = 0.5) -> Record:
    """Return a record whose friction rises before a velocity step.

    The rise has a size of ``depth`` and a length scale of 25 um.
    """
    times = np.append(np.arange(0.0, 150.0, 0.5), np.arange(150.0, 159.0, 0.05))
    moved = synthetic.load_point_displacement(LOADING, times)
    friction = synthetic.friction_and_sensitivities("slowness", times, LOADING)[0] - depth * np.exp(
        -moved / 25.0
    )
    friction += synthetic.correlated_noise(len(times), 0.5, 1e-4, seed)
    columns = {"time": times, "displacement": moved, "friction": friction}
    return rsfstudy.read_record(columns).with_steps([(150.0, 150.0, 2.0, 20.0)])


def test_a_window_begins_where_friction_has_become_straight() -> None:
    fit = rsfstudy.fit(run_in(), **OPTIONS).squeeze()
    for name in ("a", "b", "slip_distance"):
        assert abs(deviation_in_stderrs(fit, name, EXACT_PARAMETERS[name])) < 3.5, name
    assert float(fit.mu_star) == pytest.approx(0.6, abs=1e-3)
    assert 80.0 < float(fit.window_begins) < 260.0
    assert "earlier friction is not a straight line" in str(fit.message.values)


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_correlated_noise_is_straight(rho: float) -> None:
    time = np.arange(400.0)
    for seed in range(30):
        friction = 0.6 + 1e-5 * time + synthetic.correlated_noise(len(time), rho, 1e-3, seed)
        assert find_start_of_linear_friction(time, friction, 0.0, 400.0) == 0.0


def test_outliers_do_not_cut_the_window() -> None:
    time = np.arange(400.0)
    for seed in range(10):
        friction = 0.6 + 1e-5 * time + synthetic.correlated_noise(len(time), 0.5, 1e-4, seed)
        friction[[40, 97, 220]] += [0.02, -0.02, 0.02]
        assert find_start_of_linear_friction(time, friction, 0.0, 400.0) == 0.0


def test_stated_extents_that_are_cut_are_reported() -> None:
    record = run_in(depth=0.0)
    fit = rsfstudy.fit(record, **OPTIONS, before="400 um", after="500 um").squeeze()
    assert Status.labels_by_code()[int(fit.status)] == "ok"
    message = str(fit.message.values)
    assert "before= is reduced from 400 to 300 um" in message
    assert "after= is reduced from 500 to 179 um because of the end of the record" in message
    whole = rsfstudy.fit(record, **OPTIONS, before="200 um", after="150 um").squeeze()
    assert "cut" not in str(whole.message.values)


def test_a_load_point_that_is_set_to_zero_is_named() -> None:
    record = run_in(depth=0.0)
    moved = record.columns["displacement"] - np.where(record.time > 155.0, 250.0, 0.0)
    reset = rsfstudy.read_record({**record.columns, "displacement": moved})
    with pytest.raises(InvalidValue, match=r"decreases suddenly at 155\S* s.*record\.window"):
        rsfstudy.fit(reset, **OPTIONS)


def test_negative_friction_is_refused_with_the_remedy() -> None:
    record = run_in(depth=0.0)
    negative = rsfstudy.read_record({**record.columns, "friction": -record.columns["friction"]})
    fit = rsfstudy.fit(negative, **OPTIONS).squeeze()
    assert Status.labels_by_code()[int(fit.status)] == "not_applicable"
    assert "write a scale of -1" in str(fit.message.values)
