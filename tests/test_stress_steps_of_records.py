"""Tests of normal stress steps in records: detection and fits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import synthetic_records as synthetic
from scipy.integrate import solve_ivp
from synthetic_records import deviation_in_stderrs

import rsfstudy
from rsfstudy.fitting.normal_stress_steps import find_normal_stress_steps
from rsfstudy.fitting.record import Record
from rsfstudy.status import Status

#: Parameters in um and s. The stiffness of the machine is in MPa/um.
TRUTH = {"a": 0.009, "b": 0.012, "slip_distance": 15.0, "alpha": 0.3, "mu_star": 0.55}
MACHINE, VELOCITY, FIRST, SECOND = 0.03, 5.0, 6.0, 7.5
#: Times in s at which the rise of normal stress begins and ends.
BEGINS, ENDS = 30.0, 30.6
FREE = ("a", "b", "slip_distance", "alpha", "mu_star")
OPTIONS: dict[str, Any] = {
    "laws": ["slowness"],
    "stiffness": f"{MACHINE} MPa/um",
    "slip_distance": 12.0,
    "noise": "ar1",
    "engine": "compiled",
}


def stressed(seed: int = 1, size: float = 2e-5) -> Record:
    """Return a record of a normal stress step at constant velocity.

    With the shear stress tau and the normal stress sigma, the ageing law with the effect of
    Linker and Dieterich is psi' = (V/D_c) [exp(-psi - w) - 1] - (alpha/b) sigma'/sigma.
    """
    a, b, distance, alpha, mu_star = TRUTH.values()
    rate = (SECOND - FIRST) / (ENDS - BEGINS)

    def sigma_at(t: float) -> float:
        return FIRST + rate * min(max(t - BEGINS, 0.0), ENDS - BEGINS)

    def rates(t: float, y: np.ndarray, rises: float) -> np.ndarray:
        tau, psi = y
        w = (tau / sigma_at(t) - mu_star - b * psi) / a
        speed = VELOCITY * math.exp(w)
        change = speed / distance * math.expm1(-psi - w) - alpha / b * rises / sigma_at(t)
        return np.array([MACHINE * (VELOCITY - speed), change])

    time = np.arange(0.0, 90.0, 0.1)
    state, tau = np.array([mu_star * FIRST, 0.0]), np.empty(len(time))
    pieces = ((0.0, BEGINS, 0.0), (BEGINS, ENDS, rate), (ENDS, 90.0, 0.0))
    for begins, ends, rises in pieces:
        here = (time >= begins) & (time < ends)
        at = np.unique([*time[here], ends])
        options = {"args": (rises,), "rtol": 1e-10, "atol": 1e-12}
        solved = solve_ivp(rates, (begins, ends), state, "LSODA", at, **options)
        tau[here], state = solved.y[0, : int(here.sum())], solved.y[:, -1]
    sigma = np.array([*map(sigma_at, time)])
    friction = tau / sigma + synthetic.correlated_noise(len(time), 0.3, size, seed)
    columns = {
        "time": time,
        "displacement": VELOCITY * time,
        "friction": friction,
        "normal_stress": sigma,
    }
    return rsfstudy.read_record(columns, name="stressed")


@pytest.mark.parametrize("rho", [0.0, 0.9])
@pytest.mark.parametrize("drift", [0.0, 0.2])
def test_steps_and_ramps_of_normal_stress_are_found(rho: float, drift: float) -> None:
    time = 0.1 * np.arange(3_000)
    level = 8e6 * (1.0 + drift * time / time[-1])
    shape = np.interp(time, [99.9, 100.0, 200.0, 210.0], [1.0, 1.2, 1.2, 0.8])
    noise = synthetic.correlated_noise(len(time), rho, 0.01, 5)
    first, second = find_normal_stress_steps(time, level * (shape + noise))
    assert (first.start_time, first.end_time) == pytest.approx((99.95, 99.95), abs=0.3)
    assert first.normal_stress_after / first.normal_stress_before == pytest.approx(1.2, abs=0.03)
    assert (second.start_time, second.end_time) == pytest.approx((200.0, 210.0), abs=1.5)
    assert second.normal_stress_after / second.normal_stress_before == pytest.approx(
        0.8 / 1.2, abs=0.03
    )


@pytest.mark.parametrize("rho", [0.0, 0.9, 0.999])
@pytest.mark.parametrize("drift", [0.0, 0.3])
def test_noise_and_drift_are_no_steps(rho: float, drift: float) -> None:
    time = 0.1 * np.arange(3_000)
    for seed in range(20):
        noise = synthetic.correlated_noise(len(time), rho, 0.02, seed)
        assert find_normal_stress_steps(time, 8e6 * (1.0 + drift * time / time[-1] + noise)) == []


def test_a_step_of_normal_stress_is_listed_among_those_of_velocity() -> None:
    record = stressed()
    (row,) = record.steps().to_dataframe().to_dict("records")
    printed = record.step_table()
    assert printed.index.tolist() == [1]
    assert printed["normal_stress_before (MPa)"].item() == 1e-6 * row["normal_stress_before"]
    assert printed["normal_stress_after (MPa)"].item() == 1e-6 * row["normal_stress_after"]
    assert printed["velocity_before (um/s)"].item() == row["velocity_before"]
    assert printed["begins (s)"].item() == row["begins"]
    assert len(printed.columns) == len(row)
    assert (row["begins"], row["ends"]) == pytest.approx((BEGINS, ENDS), abs=0.05)
    assert row["velocity_before"] == row["velocity_after"] == pytest.approx(VELOCITY)
    stresses = row["normal_stress_before"], row["normal_stress_after"]
    assert stresses == pytest.approx((1e6 * FIRST, 1e6 * SECOND))
    moved = np.interp(record.time, [0.0, 60.0, 90.0], [0.0, 300.0, 600.0])
    columns = {**record.columns, "displacement": moved}
    both = rsfstudy.read_record({**columns, "normal_stress": columns["normal_stress"] * 1e-6})
    steps = both.steps()
    assert steps.begins.values == pytest.approx([BEGINS, 60.0], abs=0.1)
    assert steps.velocity_after.values == pytest.approx([5.0, 10.0], rel=0.01)
    assert steps.normal_stress_before.values == pytest.approx([1e6 * FIRST, 1e6 * SECOND])


@pytest.mark.parametrize("loading", ["steps", "recorded"])
@pytest.mark.parametrize("stated", [False, True])
def test_the_response_to_a_step_of_normal_stress_is_fitted(loading: str, stated: bool) -> None:
    record = stressed()
    if stated:
        record = record.with_steps([(BEGINS, ENDS, VELOCITY, VELOCITY)])
    fit = rsfstudy.fit(record, **OPTIONS, free=FREE, loading=loading).squeeze()
    assert Status.labels_by_code()[int(fit.status)] == "ok"
    for name in FREE:
        assert abs(deviation_in_stderrs(fit, name, TRUTH[name])) < 3.5, name


def test_a_step_of_normal_stress_at_constant_normal_stress_is_refused() -> None:
    fit = rsfstudy.fit(stressed(), **OPTIONS).squeeze()
    assert Status.labels_by_code()[int(fit.status)] == "not_applicable"
    assert "normal stress varies from 6 to 7.5 MPa" in str(fit.message.values)
    assert "normal_stress=imposed" in str(fit.message.values)


def test_a_step_that_changes_nothing_is_an_answer() -> None:
    columns = {n: v for n, v in stressed().columns.items() if n != "normal_stress"}
    record = rsfstudy.read_record(columns).with_steps([(BEGINS, ENDS, VELOCITY, VELOCITY)])
    fit = rsfstudy.fit(record, **OPTIONS | {"stiffness": 5e-3}).squeeze()
    assert Status.labels_by_code()[int(fit.status)] == "not_identified"
    guess = rsfstudy.fit(record, **OPTIONS | {"stiffness": 5e-3}, b_over_a=1e12).squeeze()
    assert Status(int(guess.status)).label != "cell_raised"
