"""Synthetic records from an independent implementation of one-state friction.

SciPy integrates the equations and their sensitivities. With psi = ln(theta V_0/D_c), w =
ln(V/V_0) = (mu - mu_* - b psi)/a and u = psi + w, the equations are

    mu' = k (V_l - V),    psi' = (V/D_c) h(u),    S' = (df/dy) S + df/dp.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from scipy.integrate import solve_ivp

import rsfstudy
from rsfstudy.fitting.record import Record

#: Parameters in um and s, for a velocity step from 1 to 10 um/s after 40 um.
EXACT_PARAMETERS = {
    "a": 0.010,
    "b": 0.013,
    "slip_distance": 10.0,
    "mu_star": 0.6,
    "stiffness": 3e-3,
}
STEP_UP = ((0.0, 1.0), (40.0, 10.0))
#: A velocity step down, and a slide-hold-slide test.
STEP_DOWN = ((0.0, 10.0), (4.0, 1.0))
SLIDE_HOLD_SLIDE = ((0.0, 1.0), (40.0, 0.0), (140.0, 1.0))
#: A velocity step up, and a step back at 180 um.
STEP_UP_AND_BACK = ((0.0, 1.0), (40.0, 10.0), (54.0, 1.0))
#: Options of the fits of these records.
FIT_OPTIONS: dict[str, Any] = {
    "stiffness": EXACT_PARAMETERS["stiffness"],
    "noise": "ar1",
    "engine": "compiled",
}
#: Parameters of the sensitivities. The derivatives by stiffness and slip distance are
#: logarithmic.
SENSITIVITY_PARAMETERS = ("a", "b", "stiffness", "slip_distance")

LawFunction = Callable[[float], tuple[float, float]]
#: h(u) and dh/du for each law, with the law names of the package.
LAW_FUNCTIONS: dict[str, LawFunction] = {
    "slip": lambda u: (-u, -1.0),
    "slowness": lambda u: (math.expm1(-u), -math.exp(-u)),
    "perrin_rice_zheng": lambda u: (-math.sinh(u), -math.cosh(u)),
    "family": lambda u: (math.expm1(-0.5 * u) / 0.5, -math.exp(-0.5 * u)),
}


def sample_times(loading: Sequence[tuple[float, float]], ends: float, count: int) -> np.ndarray:
    """Return times at equal increments of load point displacement.

    If the loading contains holds, half of the samples are at equal increments of time.
    """
    times = np.linspace(loading[0][0], ends, 20 * count + 1)
    moved = load_point_displacement(loading, times)
    share = moved / moved[-1]
    if any(speed == 0.0 for _begins, speed in loading):
        share = 0.5 * (share + times / times[-1])
    return np.interp(np.linspace(0.0, 1.0, count), share, times)


def loading_end_time(loading: Sequence[tuple[float, float]]) -> float:
    """Return the end time of the loading.

    At this time, the load point has moved by 100 um in the last segment.
    """
    begins, speed = loading[-1]
    return begins + 100.0 / speed


def load_point_displacement(
    loading: Sequence[tuple[float, float]], times: np.ndarray
) -> np.ndarray:
    """Return the load point displacement in um at the given times.

    Each segment of loading is a pair of its start time in s and its velocity in um/s.
    """
    begins, speeds = np.array(loading).T
    knots = np.concatenate([[0.0], np.cumsum(np.diff(begins) * speeds[:-1])])
    piece = np.searchsorted(begins, times, side="right") - 1
    return np.asarray(knots[piece] + speeds[piece] * (times - begins[piece]))


def friction_and_sensitivities(
    law: str,
    times: np.ndarray,
    loading: Sequence[tuple[float, float]] = STEP_UP,
    truth: Mapping[str, float] = EXACT_PARAMETERS,
) -> tuple[np.ndarray, np.ndarray]:
    """Return friction at the given times, and its derivatives.

    The derivatives by ``SENSITIVITY_PARAMETERS`` have shape (times, parameters).
    """
    h, first = LAW_FUNCTIONS[law], loading[0][1]
    a, b, distance = truth["a"], truth["b"], truth["slip_distance"]
    k, mu_star = truth["stiffness"], truth["mu_star"]

    def rates(_t: float, y: np.ndarray, load: float) -> np.ndarray:
        mu, psi, s_mu, s_psi = y[0], y[1], y[2:6], y[6:10]
        w = (mu - mu_star - b * psi) / a
        speed, (change, slope) = first * math.exp(w), h(psi + w)
        of_a, of_b, of_k, of_distance = np.eye(4)
        dw = (s_mu - b * s_psi - of_a * w - of_b * psi) / a
        d_mu = -k * speed * dw + of_k * k * (load - speed)
        d_psi = change * dw + slope * (s_psi + dw) - of_distance * change
        scale = speed / distance
        return np.concatenate([[k * (load - speed), scale * change], d_mu, scale * d_psi])

    state, found = np.array([mu_star, *np.zeros(9)]), np.empty((len(times), 10))
    ends = [*(begins for begins, _speed in loading[1:]), math.inf]
    for (begins, load), end in zip(loading, ends, strict=True):
        here = (times >= begins) & (times < end)
        last = end if end < math.inf else times[-1]
        solved = solve_ivp(
            rates,
            (begins, last),
            state,
            "DOP853",
            np.unique([*times[here], last]),
            args=(load,),
            rtol=1e-12,
            atol=1e-14,
        )
        found[here], state = solved.y.T[: int(here.sum())], solved.y[:, -1]
    return found[:, 0], found[:, 2:6]


def two_state_friction(
    times: np.ndarray, loading: Sequence[tuple[float, float]], truth: Mapping[str, float]
) -> np.ndarray:
    """Return friction for the slip law with two states around one step.

    Theta_i is the contribution of state i to friction: ``dTheta_i/dt = -(V/L_i)(Theta_i +
    b_i w)``.
    """
    (_begins, first), (step, load) = loading
    mu_star, k, a = (truth[name] for name in ("mu_star", "stiffness", "a"))
    b = np.array([truth["b1"], truth["b2"]])
    distances = np.array([truth["slip_distance"], truth["slip_distance_2"]])

    def rates(_t: float, y: np.ndarray) -> np.ndarray:
        w = (y[0] - mu_star - y[1] - y[2]) / a
        speed = first * math.exp(w)
        return np.array([k * (load - speed), *(-speed / distances * (y[1:] + b * w))])

    friction, later = np.full(len(times), mu_star), times >= step
    begin, span = np.array([mu_star, 0.0, 0.0]), (step, times[-1])
    solved = solve_ivp(rates, span, begin, "LSODA", times[later], rtol=1e-10, atol=1e-13)
    friction[later] = solved.y[0]
    return friction


def correlated_noise(count: int, rho: float, size: float, seed: int) -> np.ndarray:
    """Return first-order autoregressive noise (white if ``rho`` is 0)."""
    drawn = np.random.default_rng(seed).standard_normal(count)
    for row in range(1, count):
        drawn[row] = rho * drawn[row - 1] + math.sqrt(1.0 - rho * rho) * drawn[row]
    return size * drawn


def synthetic_record(
    loading: tuple[tuple[float, float], ...] = STEP_UP,
    law: str = "slowness",
    trend: float = 0.0,
    seed: int = 0,
    count: int = 400,
    size: float = 3e-4,
    truth: Mapping[str, float] = EXACT_PARAMETERS,
) -> Record:
    """Return a record with a noise correlation of 0.5.

    The friction has a linear trend if ``trend`` is not 0.
    """
    times = sample_times(loading, loading_end_time(loading), count)
    moved = load_point_displacement(loading, times)
    friction = friction_and_sensitivities(law, times, loading, truth)[0] + trend * (moved - 40.0)
    friction += correlated_noise(count, 0.5, size, seed)
    arrays = {"time": times, "displacement": moved, "friction": friction}
    steps = [(t, t, one, other) for (_, one), (t, other) in itertools.pairwise(loading)]
    return rsfstudy.read_record(arrays, name=f"record_{seed}").with_steps(steps)


def deviation_in_stderrs(fit: xr.Dataset, name: str, true: float) -> float:
    """Return the deviation from the true value in standard errors."""
    return float((fit[name] - true) / fit[f"{name}_stderr"])
