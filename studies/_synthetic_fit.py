"""Fits of synthetic records with known parameters.

The measure ``SyntheticFit`` computes a record from a scene, adds noise, and fits the record.
Several studies use this measure to test confidence intervals and standard errors.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.linalg import solve_toeplitz, toeplitz

from rsfstudy import Accuracy, Axis, Scene
from rsfstudy.errors import InvalidValue
from rsfstudy.fitting import (
    LOGARITHMIC_PARAMETERS,
    check_free_parameters,
    scene_to_parameters,
    strip_window_number,
)
from rsfstudy.fitting.confidence_intervals import LikelihoodProfile, compute_student_t_quantile
from rsfstudy.fitting.fit_problem import FitProblem
from rsfstudy.fitting.fit_solution import FitSolution
from rsfstudy.fitting.fit_validity_checks import find_reasons_for_invalid_stderrs
from rsfstudy.fitting.joint_window_model import (
    JointWindowModel,
    add_window_numbers_to_parameter_names,
)
from rsfstudy.fitting.noise_models import check_noise_model_name
from rsfstudy.fitting.window_model import ParameterValues, WindowModel, check_fields_positive
from rsfstudy.measures import Measure, Outcome, Output, OutputValue, Quantity, Status
from rsfstudy.motion import Integrator

from ._noise_kinds import NOISE_KINDS, ExactResponse

#: Correlation of the autoregressive noise between successive rows. The second value contains the
#: coefficients of the moving averages.
_AR1_CORRELATION, _MOVING_AVERAGES = 0.9, {"white": (1.0,), "ma3": (1.0, 0.8, 0.5, 0.2)}
_PROCESSES = ("ar1", *_MOVING_AVERAGES, *NOISE_KINDS)
#: Probability that a Gaussian variable lies within one standard deviation of the mean. The second
#: value is the probability for two standard deviations.
SHARE_WITHIN_ONE_STDERR, SHARE_WITHIN_TWO_STDERRS = 0.6827, 0.9545
#: Scene, work budget and protocols of the studies that fit synthetic records. The protocols contain
#: a velocity step from 1 to 10 um/s and a step back.
BASE_SCENE = Scene(normal_stress="constant", a=0.01, b_over_a=1.3, stiffness=0.03)
FIT_ACCURACY = Accuracy(budget=50_000_000, engine="compiled")
STEP_UP_PROTOCOL, STEP_BACK_PROTOCOL = "1:30, 10:270", "10:30, 1:270"
_NUMBER_PATTERN = r"\s*(\d+\.?\d*(?:e[-+]?\d+)?)\s*"
#: Pattern of a protocol segment: velocity and displacement. If the letter s follows the second
#: number, this number is the duration in s.
_SEGMENT_PATTERN = re.compile(rf"{_NUMBER_PATTERN}:{_NUMBER_PATTERN}(s?)\s*")
#: Ratio of the initial value of the slip distance in a fit to the exact slip distance.
_INITIAL_SLIP_DISTANCE_FACTOR = 1.5

_PARAMETER_OUTPUTS = (
    ("estimate", "parameter, or its logarithm"),
    (
        "deviation",
        "difference between the fitted and the true parameter, or between their logarithms",
    ),
    ("spread", "standard error of the parameter, or of its logarithm"),
    ("promised_spread", "standard error from Fisher's information"),
    ("inside_one", "1 if the true value is within the 68.3 % confidence interval, otherwise 0"),
    ("inside_two", "1 if the true value is within the 95.4 % confidence interval, otherwise 0"),
    (
        "naive_inside_one",
        "1 if the true value is within the 68.3 % confidence interval for white noise, otherwise 0",
    ),
    (
        "naive_inside_two",
        "1 if the true value is within the 68.3 % confidence interval for white noise, otherwise 0",
    ),
    ("told", "1 if the record constrains the parameter, otherwise 0"),
)
_FLAGGED_OUTPUT = Output(
    "flagged", "", "1", "1 if standard errors are reported as not valid, otherwise 0"
)


def protocol_axis(protocols: Mapping[str, str]) -> Axis:
    """Return an axis of named protocols.

    Parameters
    ----------
    protocols : mapping
        Protocols, keyed by name.

    Returns
    -------
    Axis
        Axis with the dimension ``design``.
    """
    return Axis("design", {name: {"protocol": text} for name, text in protocols.items()})


class _ProtocolSegment(NamedTuple):
    """Segment of a protocol.

    Attributes
    ----------
    velocity : float
        Load point velocity in um/s.
    duration : float
        Duration in s.
    rows : int
        Number of rows.
    """

    velocity: float
    duration: float
    rows: int


@dataclass(frozen=True)
class SyntheticFit(Measure):
    """Fit of a synthetic record, compared with the exact parameters.

    The record is computed from the scene under a given protocol. Rows are evenly spaced in load
    point displacement, or in time during a hold. Slip in the scene is in units of the slip distance
    (``slip_distance``).

    Parameters
    ----------
    protocol : str, optional
        Velocities in um/s and displacements in um: ``"1:30, 10:270"`` is a step after 30 um. A hold
        is specified by its duration: ``"0:100 s"``. Semicolons separate windows that are fitted
        jointly.
    free : tuple of str, optional
        Names of the free parameters.
    slip_distance : float, default: 10.0
        Slip distance D_c in um.
    rows : int, default: 500
        Number of rows in each window.
    noise_size : float, default: 0.0005
        Standard deviation of the noise.
    process : str, default: "white"
        Noise process: "white", "ar1" (autoregressive with a correlation of 0.9), "ma3" (a moving
        average of four rows), or a kind of laboratory record (``_noise_kinds.NOISE_KINDS``), which
        selects its own sample times.
    noise : str, default: "ar"
        Noise model of the fit (see ``Fit``).
    fitted_law : str, optional
        Law that is fitted. The default is the law of the scene.
    seed : int, default: 0
        Seed of the random noise.
    """

    protocol: str = STEP_UP_PROTOCOL
    free: tuple[str, ...] = ("a", "b", "slip_distance", "mu_star", "trend1")
    slip_distance: float = 10.0
    rows: int = 500
    noise_size: float = 5e-4
    process: str = "white"
    noise: str = "ar"
    fitted_law: str = ""
    seed: int = 0
    name: ClassVar[str] = "synthetic_fit"
    primary_output = "deviation"
    typical_rhs_evaluations = 400_000
    dimensions = (
        Quantity("parameter", "", "", "fitted parameter"),
        Quantity("protocol", "", "", "load point velocities and displacements"),
        Quantity("slip_distance", "$D_c$", "um", "characteristic slip distance"),
        Quantity("rows", "", "1", "rows of a window"),
        Quantity("noise_size", "", "1", "standard deviation of the noise"),
        Quantity("process", "", "", "simulated noise"),
        Quantity("noise", "", "", "model of the noise"),
        Quantity("fitted_law", "", "", "fitted law"),
        Quantity("seed", "", "1", "number of the noise realisation"),
    )

    def __post_init__(self) -> None:
        """Check the parameters."""
        windows = self._window_segments()
        check_free_parameters(self.free)
        if self.process not in _PROCESSES:
            raise InvalidValue("process", self.process, "is unknown", choices=_PROCESSES)
        check_fields_positive(self, "slip_distance", "noise_size")
        if self.rows < 10 * len(windows[0]):
            raise InvalidValue("rows", self.rows, "must be at least ten per segment")
        if self.seed < 0:
            raise InvalidValue("seed", self.seed, "must be 0 or greater")
        check_noise_model_name(self.noise)

    @property
    def outputs(self) -> Sequence[Output]:
        """Outputs for each parameter, and outputs that describe the quality of the fit."""
        by = [
            Output(name, "", "1", text, dims=("parameter",), error=name == self.primary_output)
            for name, text in _PARAMETER_OUTPUTS
        ]
        text = "Akaike information criterion, including the noise model"
        order = Output("noise_order", "", "1", "order of the autoregressive process of the noise")
        return (*by, Output("aic", "", "1", text), order, _FLAGGED_OUTPUT)

    @property
    def output_coordinates(self) -> Mapping[str, np.ndarray]:
        """Names of the parameters.

        If each window has a separate value of a parameter, the value of the first window is
        reported.
        """
        return {"parameter": np.array(self.free, dtype=object)}

    @property
    def _free_parameters(self) -> tuple[str, ...]:
        """Names of the free parameters, including the numbers of the fitted windows."""
        return add_window_numbers_to_parameter_names(self.free, len(self._window_segments()))

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Draw a synthetic record, and fit the record.

        Parameters
        ----------
        scene : Scene
            Parameters of the slider.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Outcome of the measure.
        """
        if self.process in NOISE_KINDS:
            return self._fit_noisy_record(scene, integrator)
        true = self._exact_parameters(scene)
        truth = self._joint_model(scene, integrator)
        clean = truth.compute_model_friction(true)
        if not np.isfinite(clean).all():
            return Outcome(Status.NOT_APPLICABLE, message="the true motion cannot be computed")
        rng, size = np.random.default_rng(self.seed), self.noise_size
        root = _noise_factor(self.process, self.rows)
        noise = np.concatenate([root @ rng.standard_normal(self.rows) for _ in truth.window_models])
        fitted = scene.with_(law=self.fitted_law) if self.fitted_law else scene
        model = self._joint_model(fitted, integrator, clean + size * noise)
        search = FitProblem(
            model, self._initial_parameters(fitted, true), self._free_parameters, self.noise
        )
        found = search.solve()
        promised = self._expected_stderrs(truth, true)
        reasons = find_reasons_for_invalid_stderrs(found, model.recorded_friction)
        return Outcome(Status.OK, self._compare_with_exact(search, found, true, promised, reasons))

    def _fit_noisy_record(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Generate a laboratory record, and fit the record as ``rsfstudy.fit()`` does."""
        from rsfstudy.measures import Fit  # The import is slow.

        kind, true = NOISE_KINDS[self.process], self._exact_parameters(scene)
        if "trend1" in true:
            true["trend1"] = kind.trend
        windows = self._window_segments()
        if len(windows) > 1 or len(windows[0]) != 2:
            rule = "is only defined for a protocol with one step"
            raise InvalidValue("process", self.process, rule, choices=_PROCESSES)
        before, after = windows[0]
        smooth = integrator.tightened_to(1e-9)

        def friction(time: np.ndarray) -> np.ndarray:
            """Return the exact friction at given times."""
            begins = min(float(time[0]), 0.0)
            pieces = [
                (begins, before.velocity, 1.0, 0.0),
                (before.duration, after.velocity, 1.0, 0.0),
            ]
            zeros = np.zeros(len(time))
            return WindowModel(
                scene, time, zeros, zeros, np.array(pieces), smooth
            ).compute_model_friction(true)

        ends = before.duration + after.duration
        step = before.duration, ends, before.velocity, after.velocity
        # The noise differs between the kinds, so that their coverages are independent.
        rng = np.random.default_rng([self.seed, [*NOISE_KINDS].index(self.process)])
        record = kind.draw(ExactResponse(*step, friction, self.noise_size), rng)
        guess, stated = _INITIAL_SLIP_DISTANCE_FACTOR * self.slip_distance, kind.filter
        fit = Fit((record,), self.free, guess, noise=self.noise, filter=stated)
        fitted = scene.with_(law=self.fitted_law) if self.fitted_law else scene
        fitted = fitted.with_(stiffness=fitted.stiffness * guess / self.slip_distance)
        search, found = fit.solve(fitted, integrator)
        unknown = np.full(len(self.free), math.nan)
        reasons = fit.find_validity_problems(search, found)
        return Outcome(Status.OK, self._compare_with_exact(search, found, true, unknown, reasons))

    def _compare_with_exact(
        self,
        search: FitProblem,
        found: FitSolution,
        true: ParameterValues,
        promised: np.ndarray,
        reasons: Sequence[str],
    ) -> dict[str, OutputValue]:
        """Compare the result of a fit with the exact parameters."""
        naive = found
        if self.noise != "white":
            naive = FitProblem(
                search.model, found.parameter_values, self._free_parameters, "white"
            ).solve()
        exact = search.compute_fit_coordinates(true)
        profiles = [LikelihoodProfile(search, found, name) for name in self._free_parameters]
        # Noise of the load point displacement widens the intervals in proportion.
        wider = np.array(
            [
                found.fit_coordinate_stderr[one.parameter_index] / one.stderr_from_noise
                for one in profiles
            ]
        )
        nearer = profiles[0].best_coordinates + (exact - profiles[0].best_coordinates) / wider
        each = zip(profiles, nearer.tolist(), strict=True)
        squared = [one.compute_twice_log_likelihood_decrease(x) for one, x in each]
        naively = np.square(
            (search.compute_fit_coordinates(naive.parameter_values) - exact)
            / naive.fit_coordinate_stderr
        )
        by_parameter = {
            "estimate": search.compute_fit_coordinates(found.parameter_values),
            "deviation": search.compute_fit_coordinates(found.parameter_values) - exact,
            "deviation_error": np.array(
                [found.parameter_numerical_errors[n] for n in self._free_parameters]
            )
            / found.parameter_derivatives_by_fit_coordinates,
            "spread": found.fit_coordinate_stderr,
            "promised_spread": promised,
            "told": np.array(
                [float(n not in found.unidentified_parameters) for n in self._free_parameters]
            ),
        }
        for words, share in (("one", SHARE_WITHIN_ONE_STDERR), ("two", SHARE_WITHIN_TWO_STDERRS)):
            for prefix, of, far in (("", found, squared), ("naive_", naive, naively)):
                inside = np.array(far) <= compute_student_t_quantile(of, share) ** 2
                by_parameter[f"{prefix}inside_{words}"] = inside.astype(float)
        # If a parameter has a separate value in each window, the first window is reported.
        shown = [
            self._free_parameters.index(n if n in self._free_parameters else f"{n}_1")
            for n in self.free
        ]
        values: dict[str, OutputValue] = {name: each[shown] for name, each in by_parameter.items()}
        values |= {"aic": found.aic, "noise_order": found.noise_model.autoregressive_order}
        return values | {"flagged": float(bool(reasons))}

    def _window_segments(self) -> list[list[_ProtocolSegment]]:
        """Return the protocol segments of each window."""
        return [_parse_segments(text, self.rows) for text in self.protocol.split(";")]

    def _exact_parameters(self, scene: Scene) -> dict[str, float]:
        """Return the exact values of all parameters."""
        longer = self.slip_distance * (scene.as_dict().get("length_ratio") or 1.0)
        plainly = scene_to_parameters(scene, self.slip_distance, longer)
        plainly |= {name: 0.0 for name in self.free if name not in plainly}
        names = add_window_numbers_to_parameter_names(tuple(plainly), len(self._window_segments()))
        return {name: plainly[strip_window_number(name)] for name in names}

    def _initial_parameters(self, scene: Scene, true: ParameterValues) -> dict[str, float]:
        """Return initial parameters that differ slightly from the exact values."""
        first = {
            n: v
            * (
                _INITIAL_SLIP_DISTANCE_FACTOR
                if n in LOGARITHMIC_PARAMETERS and n in self.free
                else 1.0
            )
            for n, v in true.items()
        }
        if scene.law != "family":
            first.pop("law_exponent", None)
        elif "law_exponent" in self.free:
            first["law_exponent"] = 0.5
        return first

    def _joint_model(
        self, scene: Scene, integrator: Integrator, friction: np.ndarray | None = None
    ) -> JointWindowModel:
        """Return the joint model of all windows."""
        smooth = integrator.tightened_to(1e-9)
        parts = []
        for number, pieces in enumerate(self._window_segments()):
            time, moved, loading = _build_rows(pieces)
            rows = slice(number * self.rows, (number + 1) * self.rows)
            seen = np.zeros(self.rows) if friction is None else friction[rows]
            parts.append(WindowModel(scene, time, moved, seen, loading, smooth))
        return JointWindowModel(tuple(parts))

    def _expected_stderrs(self, truth: JointWindowModel, true: ParameterValues) -> np.ndarray:
        """Compute standard errors from the Fisher information and the known noise."""
        correlations = _correlations(self.process, self.rows)
        jacobian = truth.compute_jacobian(true, self._free_parameters)
        information = np.zeros((len(self._free_parameters),) * 2)
        for first in range(0, len(jacobian), self.rows):
            part = jacobian[first : first + self.rows]
            information += part.T @ solve_toeplitz(correlations, part)
        scales = np.sqrt(np.diag(information))
        inverse = np.linalg.pinv(information / np.outer(scales, scales), hermitian=True)
        return np.asarray(self.noise_size * np.sqrt(np.diag(inverse)) / scales)


def _parse_segments(text: str, rows: int) -> list[_ProtocolSegment]:
    """Return the protocol segments of a window."""
    found: list[tuple[float, float, float]] = []
    for part in text.split(","):
        stated = _SEGMENT_PATTERN.fullmatch(part)
        speed, size = map(float, stated.group(1, 2)) if stated else (0.0, 0.0)
        if not stated or not size > 0.0 or (speed == 0.0) != bool(stated[3]):
            remedy = "Write, for example, '1:30, 10:270', or with a hold '1:30, 0:100 s, 1:270'."
            raise InvalidValue("protocol", text, "is not a protocol", remedy=remedy)
        found.append((speed, size / (speed or 1.0), size))
    if len(found) < 2 or not found[0][0] > 0.0:
        raise InvalidValue(
            "protocol", text, "must begin with sliding, followed by a change of velocity"
        )
    moved = math.fsum(size for speed, _lasts, size in found if speed)
    held = sum(not speed for speed, _lasts, _size in found)
    each = rows // (len(found) + 1) if held else 0
    sliding = rows - held * each
    counts = [int(sliding * size / moved) if speed else each for speed, _lasts, size in found]
    counts[-1] += rows - sum(counts)
    return [
        _ProtocolSegment(s, lasts, n) for (s, lasts, _size), n in zip(found, counts, strict=True)
    ]


def _build_rows(pieces: Sequence[_ProtocolSegment]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the times, displacements and loading history of a window.

    Displacements are measured from the first velocity step of the window.
    """
    begins = np.cumsum([0.0, *(piece.duration for piece in pieces)])
    moved = np.cumsum([0.0, *(piece.duration * piece.velocity for piece in pieces)])
    time, displacement = [], []
    for number, piece in enumerate(pieces):
        part = (np.arange(piece.rows) + 0.5) / max(piece.rows, 1)
        time.append(begins[number] + part * piece.duration)
        displacement.append(moved[number] + part * piece.duration * piece.velocity)
    loading = np.array(
        [(t, p.velocity, 1.0, 0.0) for t, p in zip(begins[:-1], pieces, strict=True)]
    )
    return np.concatenate(time), np.concatenate(displacement) - moved[1], loading


@lru_cache(maxsize=8)
def _noise_factor(process: str, rows: int) -> np.ndarray:
    """Return the matrix that converts white noise to correlated noise of a given process."""
    return np.asarray(np.linalg.cholesky(toeplitz(_correlations(process, rows))))


def _correlations(process: str, rows: int) -> np.ndarray:
    """Return the autocorrelations of a noise process at each lag."""
    if process == "ar1":
        return np.asarray(_AR1_CORRELATION ** np.arange(rows))
    weights = _MOVING_AVERAGES[process]
    found, told = np.zeros(rows), np.correlate(weights, weights, "full")[len(weights) - 1 :]
    found[: len(told)] = told / told[0]
    return found
