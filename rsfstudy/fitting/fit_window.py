"""Windows of a record around steps, and functions that guess initial parameter values.

A ``FitWindow`` selects the rows of a record around a step, and creates the model of the selected
rows. The function ``guess_initial_parameter_values`` estimates initial parameters from the recorded
friction.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.ndimage import median_filter

from rsfstudy.fitting.linear_friction_before_step import find_start_of_linear_friction
from rsfstudy.fitting.load_point_noise import (
    copy_steps_shifted_by_their_errors,
    integrate_load_point_velocity,
)
from rsfstudy.fitting.normal_stress_steps import MIN_RELATIVE_NORMAL_STRESS_CHANGE
from rsfstudy.fitting.record import Record
from rsfstudy.fitting.recorded_loading import (
    build_loading_history,
    build_stepwise_loading_history,
    find_loading_steps_between,
)
from rsfstudy.fitting.velocity_steps import LoadingStep, noise_variance
from rsfstudy.fitting.window_model import WindowModel, scene_to_parameters
from rsfstudy.motion import Integrator, MotionStopped
from rsfstudy.slider import Scene
from rsfstudy.status import Status

#: The first value is the default start of the window of a step, as a fraction of the interval
#: between the previous step and the step. The second value is the smallest number of rows per free
#: parameter.
_WINDOW_START_BEFORE_STEP_FRACTION, _MIN_ROWS_PER_PARAMETER = 0.5, 3
#: Largest delay of the loading, relative to the time between the start of the window and the step.
_MAX_LOADING_DELAY_OVER_TIME_BEFORE_STEP = 0.2
#: A remark is added to the result if the ratio of the actual extent of a window to its requested
#: extent is less than this value.
_MIN_WINDOW_OVER_REQUESTED_WINDOW = 0.98
#: Allowed values of the option ``loading``.
LOADING_HISTORY_SOURCES = ("steps", "recorded")
#: Settings for comparing the recorded normal stress with the normal stress of the model. The first
#: value is the number of rows in a running median that reduces the noise. The second value is the
#: quantile of the differences that is compared with a limit. The third value is the number of
#: standard deviations of the noise that is added to the limit.
_RUNNING_MEDIAN_ROWS_OF_STRESS, _STRESS_DEPARTURE_QUANTILE, _MAX_STRESS_DEPARTURE_NOISE_SIGMAS = (
    5,
    0.99,
    2.0,
)
#: A step is too small for estimating initial values of a and b if the logarithm of its velocity
#: ratio is less than this value.
_MIN_LOG_VELOCITY_RATIO_TO_GUESS_A_AND_B = 0.02


@dataclass(frozen=True)
class FitWindow:
    """Window of a record around a step.

    Parameters
    ----------
    record : Record
        Record that contains the step.
    step_number : int
        Number of the step, starting from 1.
    displacement_before_step : float, default: 0.0
        Load point displacement in um to include before the step. If 0, the window begins halfway
        between the previous step and this step, or at the beginning of the record if there is no
        previous step.
    displacement_after_step : float, default: 0.0
        Load point displacement in um to include after the step. If 0, the window ends at the next
        step or at the end of the record.
    fraction_of_displacement_after_step : float, default: 1.0
        Fraction of the displacement after the step to include.
    other_fitted_step_numbers : collection of int, optional
        Numbers of the other steps in a joint fit that belong to the same record. If the next step
        is also fitted, the window of this step ends before the window of the next step begins.

    Notes
    -----
    If friction before the step is not a linear function of time, the window begins at the time from
    which friction is linear. The window of a hold includes the sliding after the hold.

    Examples
    --------
    >>> import numpy as np
    >>> from rsfstudy.fitting import FitWindow, Record
    >>> time = np.arange(0.0, 100.0, 0.5)
    >>> displacement = np.where(time < 50.0, time, 50.0 + 10.0 * (time - 50.0))
    >>> friction = np.full(200, 0.6)
    >>> record = Record({"time": time, "displacement": displacement, "friction": friction})
    >>> window = FitWindow(record, step_number=1, displacement_before_step=30.2)
    >>> float(record.time[window.record_row_indices[0]])
    20.0
    """

    record: Record
    step_number: int
    displacement_before_step: float = 0.0
    displacement_after_step: float = 0.0
    fraction_of_displacement_after_step: float = 1.0
    other_fitted_step_numbers: Collection[int] = ()

    @property
    def loading_step(self) -> LoadingStep:
        """Step of load point velocity or normal stress in the window.

        Raises
        ------
        MotionStopped
            If the record has fewer steps than ``step_number``.
        """
        found = self.record.loading_steps
        if self.step_number > len(found):
            text = f"{self.record.name} has {len(found)} steps"
            raise MotionStopped(Status.NO_STEP, text)
        return found[self.step_number - 1]

    @property
    def record_row_indices(self) -> np.ndarray:
        """Indices of the record rows in the window."""
        time = self.record.time
        return np.flatnonzero(
            (time >= self._compute_start_time(self.loading_step))
            & (time <= self._compute_end_time())
        )

    @property
    def mean_normal_stress_before_step(self) -> float:
        """Mean normal stress, in Pa, of the window rows before the step.

        The property is NaN if the normal stress was not recorded.
        """
        time, stress = self.record.time, self.record.columns.get("normal_stress")
        if stress is None:
            return math.nan
        first, last = np.searchsorted(
            time, (self._compute_start_time(self.loading_step), self.loading_step.start)
        )
        return float(stress[min(first, len(time) - 1) : max(first + 1, last)].mean())

    @property
    def window_summary_values(self) -> dict[str, float]:
        """Velocities, window limits in um, normal stress and load point noise, keyed by name."""
        record, rows = self.record, self.record_row_indices
        moved, time = record.columns["displacement"][rows], record.time[rows]
        return {
            "load_point_noise": math.sqrt(noise_variance(time, moved)),
            "velocity_before": self.loading_step.velocity_before,
            "velocity_after": self.loading_step.velocity_after,
            "window_begins": moved[0],
            "window_ends": moved[-1],
            "normal_stress_before": self.mean_normal_stress_before_step,
        }

    def build_scene_with_machine_stiffness(self, scene: Scene, machine_stiffness: float) -> Scene:
        """Return a scene with the stiffness of a testing machine.

        The stiffness of the scene is the stiffness of the machine divided by the normal stress
        before the step.

        Parameters
        ----------
        scene : Scene
            Scene with any stiffness.
        machine_stiffness : float
            Stiffness of the machine, in Pa per slip distance of the scene. If 0, the scene is
            returned unchanged.

        Returns
        -------
        Scene
            Scene with the stiffness of the machine.
        """
        if not machine_stiffness:
            return scene
        return scene.with_(stiffness=machine_stiffness / self.mean_normal_stress_before_step)

    def _compute_end_time(self) -> float:
        """Return the time in s at which the window ends."""
        record, step = self.record, self.loading_step
        # The window of a hold includes the sliding after the hold.
        later = [
            s
            for s in record.loading_steps
            if s.start > step.end and (step.velocity_after or s.velocity_before)
        ]
        last = later[0].start if later else record.time[-1]
        if later and record.loading_steps.index(later[0]) + 1 in self.other_fitted_step_numbers:
            last = record.time[record.time < self._compute_start_time(later[0])][-1]
        moved = record.columns["displacement"]
        at = np.interp(step.start, record.time, moved)

        def reached(distance: float) -> float:
            """Return the time in s at which the load point reaches a displacement.

            The displacement in um is measured from the step. If the load point does not reach the
            displacement, the function returns the current end of the window.
            """
            beyond = (moved > at + distance) & (record.time > step.start)
            return float(record.time[np.argmax(beyond)] if beyond.any() else last)

        if self.displacement_after_step:
            last = min(last, reached(self.displacement_after_step))
        if self.fraction_of_displacement_after_step < 1.0:
            last = reached(
                self.fraction_of_displacement_after_step
                * (np.interp(last, record.time, moved) - at)
            )
        return float(last)

    def _compute_start_time(self, step: LoadingStep) -> float:
        """Return the time in s at which the window of a step begins."""
        return _find_start_of_linear_friction(
            self.record, self._compute_earliest_start_time(step), step.start
        )

    @property
    def truncation_remarks(self) -> list[str]:
        """Remarks about requested rows that the window does not include."""
        record, step, moved = self.record, self.loading_step, self.record.columns["displacement"]
        nominal, begins, at, ends = np.interp(
            [
                self._compute_earliest_start_time(step),
                self._compute_start_time(step),
                step.start,
                self._compute_end_time(),
            ],
            record.time,
            moved,
        )
        found, later = (
            [],
            "next step" if self._compute_end_time() < record.time[-1] else "end of the record",
        )
        if begins > nominal:
            found.append(
                f"the window begins {at - begins:.4g} um before the step instead of "
                f"{at - nominal:.4g} um, because the earlier friction is not a straight line"
            )
        elif at - begins < _MIN_WINDOW_OVER_REQUESTED_WINDOW * self.displacement_before_step:
            found.append(
                f"before= is reduced from {self.displacement_before_step:.4g} to "
                f"{at - begins:.4g} um, because the previous step or the beginning of the record "
                "is less than twice this distance away"
            )
        if (
            self.fraction_of_displacement_after_step == 1.0
            and ends - at < _MIN_WINDOW_OVER_REQUESTED_WINDOW * self.displacement_after_step
        ):
            cut = f"after= is reduced from {self.displacement_after_step:.4g} to {ends - at:.4g} um"
            found.append(f"{cut} because of the {later}")
        return found

    def _compute_earliest_start_time(self, step: LoadingStep) -> float:
        """Return the earliest time in s at which a window can start.

        If friction before the step is not a linear function of time, the window begins later than
        the returned time.
        """
        record = self.record
        earlier = [s.end for s in record.loading_steps if s.end < step.start]
        first = max(earlier, default=record.time[0])
        begins = step.start - (_WINDOW_START_BEFORE_STEP_FRACTION if earlier else 1.0) * (
            step.start - first
        )
        if self.displacement_before_step:
            moved = record.columns["displacement"]
            at = np.interp(step.start, record.time, moved)
            begins = max(
                begins, record.time[np.argmax(moved >= at - self.displacement_before_step)]
            )
        return float(begins)

    def create_window_model(
        self,
        scene: Scene,
        free_parameters: Collection[str],
        loading_history_source: str,
        integrator: Integrator,
    ) -> WindowModel:
        """Create the model of the window.

        The displacement in the model is zero at the step.

        Parameters
        ----------
        scene : Scene
            Scene with the friction law and the fixed parameters.
        free_parameters : collection of str
            Names of the free parameters.
        loading_history_source : {"steps", "recorded"}
            Loading of the model (see ``rsfstudy.fitting.Fit``).
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        WindowModel
            Model of the rows in the window.

        Raises
        ------
        MotionStopped
            If the window has too few rows, if the window begins in a hold, if the mean friction
            before the step is not positive, or if the recorded normal stress differs from the
            normal stress of the model.
        """
        record, step, rows = self.record, self.loading_step, self.record_row_indices
        time = record.time[rows]
        friction = record.columns["friction"][rows]
        if (
            len(rows) < _MIN_ROWS_PER_PARAMETER * len(free_parameters)
            or not step.start < self._compute_end_time()
        ):
            text = (
                f"the window contains {len(rows)} rows, which are too few for "
                f"{len(free_parameters)} parameters"
            )
            raise MotionStopped(Status.NOT_APPLICABLE, text)
        before = friction[time < step.start]
        if before.size and not before.mean() > 0.0:
            text = (
                f"the mean friction before the step is {before.mean():.3g}, but must be positive. "
                "If the shear stress has the opposite sign, write a scale of -1 after the "
                "heading: --columns 'friction=HEADING * -1' (columns=)"
            )
            raise MotionStopped(Status.NOT_APPLICABLE, text)
        begins, ends = self._compute_start_time(step), self._compute_end_time()
        pieces = build_loading_history(
            record, begins, ends, use_recorded_rows=loading_history_source == "recorded"
        )
        if scene.parts.normal_stress.name == "constant":
            # If the normal stress of the scene is constant, variations of the recorded normal
            # stress are noise.
            pieces[:, 2:] = 1.0, 0.0
        moves = (
            self._build_loadings_with_shifted_steps(begins, ends)
            if loading_history_source == "steps"
            else []
        )
        if "step_time" in free_parameters:
            for each in (pieces, *moves):
                each[0, 0] -= _MAX_LOADING_DELAY_OVER_TIME_BEFORE_STEP * (step.start - begins)
        if not pieces[0, 1] > 0.0:
            text = "the window begins in a hold, but a fit must begin with steady sliding"
            raise MotionStopped(Status.NOT_APPLICABLE, text)
        self._check_normal_stress_matches_loading(rows, pieces)
        steady = build_stepwise_loading_history(
            begins, find_loading_steps_between(record, begins, ends)
        )
        moved = integrate_load_point_velocity(steady, time, step.start)
        return WindowModel(scene, time, moved, friction, pieces, integrator, moves)

    def _build_loadings_with_shifted_steps(
        self, start_time: float, end_time: float
    ) -> list[np.ndarray]:
        """Return loading histories with shifted step times and velocities."""
        steps = find_loading_steps_between(self.record, start_time, end_time)
        others = [step for step in steps if not step.changes_velocity]
        moved = copy_steps_shifted_by_their_errors(
            self.record, [step for step in steps if step.changes_velocity]
        )
        return [
            build_stepwise_loading_history(start_time, sorted([*each, *others])) for each in moved
        ]

    def _check_normal_stress_matches_loading(
        self, row_indices: np.ndarray, loading_segments: np.ndarray
    ) -> None:
        """Raise an error if recorded and modelled normal stress differ.

        The recorded normal stress may differ from the modelled normal stress by up to 2 %, plus an
        allowance for noise.
        """
        record = self.record
        if "normal_stress" not in record.columns:
            return
        time, before = record.time[row_indices], self.mean_normal_stress_before_step
        stress = record.columns["normal_stress"][row_indices] / before
        piece = np.maximum(np.searchsorted(loading_segments[:, 0], time, side="right") - 1, 0)
        modelled = loading_segments[piece, 2] + loading_segments[piece, 3] * (
            time - loading_segments[piece, 0]
        )
        apart = np.abs(
            median_filter(stress - modelled, _RUNNING_MEDIAN_ROWS_OF_STRESS, mode="nearest")
        )
        noise = math.sqrt(noise_variance(time, stress))
        varies = (
            float(np.quantile(apart, _STRESS_DEPARTURE_QUANTILE))
            - _MAX_STRESS_DEPARTURE_NOISE_SIGMAS * noise
        )
        if varies > MIN_RELATIVE_NORMAL_STRESS_CHANGE:
            stress *= before * 1e-6
            text = (
                f"normal stress varies from {stress.min():.4g} to {stress.max():.4g} MPa within "
                f"the window, and is {before * 1e-6:.4g} MPa before the step. The model allows "
                f"changes of at most {100.0 * MIN_RELATIVE_NORMAL_STRESS_CHANGE:g} %. Shorten the "
                "window with --before and --after (before=, after=), or model the normal stress "
                "with --set normal_stress=imposed (normal_stress=). With --loading recorded "
                "(loading=), the model uses the recorded normal stress of each row, otherwise "
                "its steps. The parameter alpha is then fitted or specified"
            )
            raise MotionStopped(Status.NOT_APPLICABLE, text)


@lru_cache(maxsize=256)
def _find_start_of_linear_friction(record: Record, start_time: float, end_time: float) -> float:
    """Find the time from which friction is a linear function of time until a step."""
    return find_start_of_linear_friction(
        record.time, record.columns["friction"], start_time, end_time
    )


def compute_stiffness_ratios_to_first_window(windows: Sequence[FitWindow]) -> tuple[float, ...]:
    """Compute the ratio of stiffness to normal stress in each window.

    The machine stiffness is the same in all windows, so the ratio of stiffness to normal stress
    depends only on the normal stress. The ratio in each window is divided by the ratio in the first
    window.

    Parameters
    ----------
    windows : sequence of FitWindow
        Windows of a joint fit.

    Returns
    -------
    tuple of float
        Ratio in each window, divided by the ratio in the first window. The tuple is empty if the
        normal stress of a window is unknown.
    """
    stresses = np.array([window.mean_normal_stress_before_step for window in windows])
    known = bool(np.isfinite(stresses).all() and stresses.all())
    return tuple((stresses[0] / stresses).tolist()) if known else ()


def guess_initial_parameter_values(
    window_model: WindowModel,
    step: LoadingStep,
    free_parameters: Sequence[str],
    slip_distance_guesses: tuple[float, float],
) -> dict[str, float]:
    r"""Estimate initial values of the parameters from a record.

    Parameters that cannot be estimated keep the values of the scene.

    Parameters
    ----------
    window_model : WindowModel
        Model of a window.
    step : LoadingStep
        Step of load point velocity or normal stress in the window.
    free_parameters : sequence of str
        Names of the free parameters. The fixed parameters have the values of the scene.
    slip_distance_guesses : (float, float)
        Slip distances of the first and the second state variable in um. The first slip distance is
        also the unit of slip in the scene.

    Returns
    -------
    dict of {str: float}
        Initial values of all parameters.

    Notes
    -----
    Let :math:`\mu_0` be the mean friction before a velocity step by a factor :math:`r`,
    :math:`\mu_p` the extreme value of friction after the step, and :math:`\mu_1` the friction at
    the end of the window. The estimates of the direct effect and the evolution effect are

    .. math:: a = (\mu_p - \mu_0)/\ln r, \qquad b = (\mu_p - \mu_1)/\ln r.
    """
    scene, friction = window_model.scene, window_model.recorded_friction
    before, later = (
        friction[window_model.time < step.start],
        friction[window_model.time >= step.end],
    )
    values = scene_to_parameters(scene, *slip_distance_guesses)
    if "mu_star" in free_parameters and len(before):
        values["mu_star"] = float(np.mean(before))
    if step.velocity_after > 0.0 and len(before):
        ratio = math.log(step.velocity_after / step.velocity_before)
    else:
        ratio = 0.0
    if abs(ratio) > _MIN_LOG_VELOCITY_RATIO_TO_GUESS_A_AND_B:
        peak = later.max() if ratio > 0.0 else later.min()
        read_a = max((peak - values["mu_star"]) / ratio, 1e-3)
        read_b = (peak - float(np.mean(later[-max(len(later) // 10, 1) :]))) / ratio
        seen = {"a": read_a, "b": read_b, "b1": 0.7 * read_b, "b2": 0.3 * read_b}
        values |= {
            name: v for name, v in seen.items() if name in free_parameters and name in values
        }
    return dict.fromkeys(free_parameters, 0.0) | values
