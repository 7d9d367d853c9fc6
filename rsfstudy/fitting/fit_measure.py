"""Measure that fits friction parameters to laboratory records.

The measure ``Fit`` selects windows of records, estimates the parameters with a ``FitProblem``, and
computes confidence intervals. Users normally call ``rsfstudy.fit``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.fitting import posterior
from rsfstudy.fitting.confidence_intervals import compute_confidence_interval
from rsfstudy.fitting.filter_detection import detect_undeclared_filter
from rsfstudy.fitting.filters import Filter
from rsfstudy.fitting.fit_outputs import build_fit_outputs
from rsfstudy.fitting.fit_problem import FitProblem, FitSolution
from rsfstudy.fitting.fit_validity_checks import (
    MIN_FRICTION_NOISE_SD,
    describe_asymmetric_confidence_intervals,
    describe_load_point_noise,
    describe_outliers,
    describe_unidentified_parameters,
    find_reasons_for_invalid_stderrs,
    find_unidentified_parameters,
    is_friction_rounding_too_coarse,
)
from rsfstudy.fitting.fit_window import (
    LOADING_HISTORY_SOURCES,
    FitWindow,
    compute_stiffness_ratios_to_first_window,
    guess_initial_parameter_values,
)
from rsfstudy.fitting.joint_window_model import (
    JointWindowModel,
    add_window_numbers_to_parameter_names,
    is_per_window_parameter,
    strip_window_number,
)
from rsfstudy.fitting.noise_models import (
    WHITE_NOISE_NAME,
    check_noise_model_name,
    compute_ljung_box_p_value,
)
from rsfstudy.fitting.record import RECORD_COLUMNS, Record
from rsfstudy.fitting.window_model import (
    LAW_SPECIFIC_PARAMETERS,
    check_fields_positive,
    check_free_parameters,
    parameters_of_law,
)
from rsfstudy.measure_base import Measure, Outcome, OutputValue
from rsfstudy.motion import Integrator
from rsfstudy.quantities import Output, Quantity
from rsfstudy.slider import Scene
from rsfstudy.status import Status

#: Largest relative tolerance of the integration for which finite differences of the solution are
#: accurate.
_MAX_RTOL_FOR_FINITE_DIFFERENCES = 1e-9
#: The numerical error of a parameter is divided by a scale, which contains the standard error of
#: the parameter multiplied by this factor. With this factor, a numerical error of more than 1 % of
#: the standard error is reported as too large at the default accuracy of 1e-7.
_NUMERICAL_ERROR_SCALE_PER_STDERR = 1000.0
#: Names of the scene fields whose values are determined by every fit.
_SCENE_FIELDS_SET_BY_FIT = (
    *("a", "b_over_a", "b1_over_a", "b2_over_a", "length_ratio", "mu_star", "stiffness"),
    *("stiffness_ratio", "reference_rate", "load_velocity_ratio"),
)
#: The direct effect counts as being at its lower bound if the ratio of the direct effect to its
#: lower bound is less than this value.
_DIRECT_EFFECT_BOUND_TOLERANCE_FACTOR = 1.001


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class Fit(Measure):
    r"""Fit of friction parameters to a laboratory record by least squares.

    The fit accounts for correlated noise, whose correlation is estimated from the residuals.

    Parameters
    ----------
    records : tuple of Record
        Available records. The options ``record`` and ``together`` select the fitted records.
    free : tuple of str, default: ("a", "b", "slip_distance", "mu_star", "trend1")
        Names of the free parameters (see ``rsfstudy.fitting.PARAMETERS``). The other parameters are
        fixed at their values in the scene.
    slip_distance_guess : float, default: 10.0
        Slip distance D_c in um, which is the unit of slip in the scene. If D_c is a free parameter,
        this value is the initial guess.
    slip_distance_2_guess : float, default: 100.0
        Initial guess of the slip distance of the second state variable in um, for friction laws
        with two state variables.
    record : str, optional
        Name of the record to fit. By default, the first record is fitted.
    step : int, default: 1
        Number of the step to fit, starting from 1.
    together : tuple of (str, int), optional
        Record names and step numbers of a joint fit. This option replaces ``record`` and ``step``.
        Three parameters have a separate value for each step: the friction before the step
        (``mu_star_1``, ``mu_star_2``, ...), the trend, and the step time.
    before, after : float, default: 0.0
        Load point displacements in um before and after the step that the fit includes. If
        ``before`` is 0, the window begins halfway between the previous step and this step, or at
        the beginning of the record if there is no previous step. If ``after`` is 0, the window ends
        at the next step or at the end of the record. In a joint fit, the window of a step ends
        where the window of the next step begins.
    part : float, default: 1.0
        Fraction of the displacement after the step that is fitted.
    noise : str, default: "ar"
        Noise model: "white" for the usual formula of standard errors, "ar" for an autoregressive
        process with an automatic order, or "ar1", "ar2" and so on.
    loading : {"steps", "recorded"}, default: "steps"
        Loading of the model. With "steps", the load point velocity is constant between the steps.
        With "recorded", the model follows the recorded displacement. The model also follows the
        recorded normal stress, unless the scene has a constant normal stress.
    filter : str, optional
        Filter that was applied to friction before it was recorded, such as "mean 1.0" (see
        ``rsfstudy.fitting.Filter``). By default, friction was not filtered.
    posterior : int, default: 0
        Number of draws from the posterior distribution.
    machine_stiffness : float, default: 0.0
        Stiffness of the machine in Pa/um. In each window, the stiffness of the model is the machine
        stiffness divided by the normal stress before the step. If 0, all windows have the stiffness
        of the scene.
    stiffness_relative_stderr : float, default: 0.0
        Relative standard error of the stiffness. The standard errors of the parameters include this
        error, unless the stiffness is a free parameter.

    Raises
    ------
    InvalidValue
        If an option is invalid, or if emcee is required and not installed.

    Notes
    -----
    The model is the simulated friction of the scene under the recorded loading, plus a trend in
    powers of the load point displacement :math:`x` since the step:

    .. math::

        \mu(t) = \mu_* + a \ln(V/V_0) + \Theta + c_1 x + c_2 x^2 + \dots, \qquad
        \dot\mu = k (V_l - V),

    where :math:`V_l` is the load point velocity, :math:`V_0` is the load point velocity before the
    step, :math:`k` is the stiffness divided by the normal stress, and :math:`\Theta` is the state
    variable, which evolves by the friction law. The second equation applies to the friction without
    the trend, at constant normal stress and without inertia.

    Lengths are in um, times in s, and normal stresses in Pa. Outputs with one value per row of the
    record have the shape (rows,). The outputs ``covariance`` and ``correlation`` have the shape
    (parameters, parameters).

    For each parameter, ``<name>_stderr`` is the standard error, ``<name>_ci_low`` and
    ``<name>_ci_high`` are the ends of the 95 % confidence interval, and ``<name>_error`` is the
    numerical error. If the record does not constrain a parameter, the status is ``not_identified``,
    and the message names the parameter. The confidence interval of an unconstrained parameter
    extends to the bounds of the search, or is NaN if the search has no bounds for this parameter.

    The standard errors account for correlated noise [1]_. Fits of velocity steps are described in
    [2]_ and [3]_.

    References
    ----------
    .. [1] Patterson and Thompson (1971), Biometrika 58, 545-554.
    .. [2] Reinen and Weeks (1993), J. Geophys. Res. 98, 15937-15950.
    .. [3] Marone (1998), Annu. Rev. Earth Planet. Sci. 26, 643-696.

    Examples
    --------
    >>> import numpy as np
    >>> from rsfstudy.fitting import Fit, Record
    >>> time = np.arange(0.0, 100.0, 0.5)
    >>> displacement = np.where(time < 50.0, time, 50.0 + 10.0 * (time - 50.0))
    >>> friction = np.full(200, 0.6)
    >>> record = Record({"time": time, "displacement": displacement, "friction": friction})
    >>> fit = Fit((record,), free=("a", "b", "slip_distance", "mu_star"), after=200.0)
    >>> fit.parameters
    ('a', 'b', 'slip_distance', 'mu_star')
    """

    records: tuple[Record, ...]
    free: tuple[str, ...] = ("a", "b", "slip_distance", "mu_star", "trend1")
    slip_distance_guess: float = 10.0
    slip_distance_2_guess: float = 100.0
    record: str = ""
    step: int = 1
    together: tuple[tuple[str, int], ...] = ()
    before: float = 0.0
    after: float = 0.0
    part: float = 1.0
    noise: str = "ar"
    loading: str = "steps"
    filter: str = ""
    posterior: int = 0
    machine_stiffness: float = 0.0
    stiffness_relative_stderr: float = 0.0
    name: ClassVar[str] = "fit"
    typical_rhs_evaluations = 250_000
    dimensions = (
        Quantity("parameter", "", "", "fitted parameter"),
        Quantity("other_parameter", "", "", "fitted parameter"),
        Quantity("row", "", "1", "row of the record"),
        Quantity("record", "", "", "fitted record"),
        Quantity("step", "", "1", "number of the step in the record"),
        Quantity("before", "", "um", "fitted load point displacement before the step"),
        Quantity("after", "", "um", "fitted load point displacement after the step"),
        Quantity("part", "", "1", "fitted fraction of the record after the step"),
        Quantity("noise", "", "", "model of the noise"),
        Quantity("loading", "", "", "source of the loading"),
        Quantity("filter", "", "", "filter that was applied to friction before recording"),
    )

    def __post_init__(self) -> None:
        """Validate the options."""
        if not self.records:
            raise InvalidValue("records", self.records, "must contain at least one record")
        names = [record.name for record in self.records]
        if len(set(names)) < len(names):
            raise InvalidValue("records", names, "must have different names")
        check_free_parameters(self.free)
        for name, step in self._record_names_and_step_numbers:
            if name not in names:
                raise InvalidValue("record", name, "is unknown", choices=names)
            if step < 1:
                raise InvalidValue("step", step, "must be at least 1")
        for name in ("before", "after"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise InvalidValue(name, getattr(self, name), "must be 0 or more, in um")
        if not 0.0 < self.part <= 1.0:
            raise InvalidValue("part", self.part, "must be greater than 0 and at most 1")
        check_fields_positive(self, "slip_distance_guess", "slip_distance_2_guess")
        if self.loading not in LOADING_HISTORY_SOURCES:
            raise InvalidValue(
                "loading", self.loading, "is unknown", choices=LOADING_HISTORY_SOURCES
            )
        if "step_time" in self.free and self.loading == "recorded":
            rule = "can only be used with loading='steps'"
            raise InvalidValue("free", "step_time", rule, remedy="Leave it out.")
        check_noise_model_name(self.noise)
        Filter.parse(self.filter)
        posterior.check_posterior_sampling_is_possible(self.posterior)

    @property
    def solved_fields(self) -> tuple[str, ...]:
        """Names of the scene fields whose values the fit determines."""
        return (
            *_SCENE_FIELDS_SET_BY_FIT,
            *(name for name in ("alpha", "law_exponent") if name in self.free),
        )

    @property
    def primary_output(self) -> str:
        """Name of the first free parameter that occurs in all friction laws."""
        return next(
            (n for n in self.parameters if n not in LAW_SPECIFIC_PARAMETERS),
            self.parameters[0],
        )

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the free parameters, which include window numbers in joint fits."""
        return add_window_numbers_to_parameter_names(
            self.free, len(self._record_names_and_step_numbers)
        )

    @property
    def _record_names_and_step_numbers(self) -> tuple[tuple[str, int], ...]:
        """Record name and step number of each step that is fitted."""
        return self.together or ((self.record or self.records[0].name, self.step),)

    @cached_property
    def _fitted_windows(self) -> tuple[FitWindow, ...]:
        """Window of a record around each step that is fitted."""
        by_name = {record.name: record for record in self.records}
        others = {name: {n for other, n in self.together if other == name} for name in by_name}
        ends = self.before, self.after, self.part
        return tuple(
            FitWindow(by_name[name], n, *ends, others[name])
            for name, n in self._record_names_and_step_numbers
        )

    @property
    def outputs(self) -> Sequence[Output]:
        """Outputs of the fit, including the parameters and their errors."""
        return build_fit_outputs(
            self.parameters, self.posterior > 0, len(self._record_names_and_step_numbers)
        )

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Meanings and units of the outputs, the output dimensions and the options."""
        draws = [Quantity("draw", "", "1", "number of the draw")] if self.posterior else []
        return (*super().quantities, *draws)

    @property
    def output_coordinates(self) -> Mapping[str, np.ndarray]:
        """Coordinates of the outputs: parameter names, row indices and draw indices."""
        names = np.array(self.parameters, dtype=object)
        together = sum(map(len, self._first_output_row_by_record))
        rows = np.arange(together if self.together else max(map(len, self.records)))
        draws = {"draw": np.arange(self.posterior)} if self.posterior else {}
        return {"parameter": names, "other_parameter": names, "row": rows, **draws}

    def error_scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Return a scale for the numerical error of each parameter.

        The numerical error of a parameter is divided by its scale. The scale is the absolute value
        of the parameter plus a large multiple of the standard error of the parameter. If a
        parameter may be zero, a constant is added to its scale. Without this constant, the scale
        would be zero for a record without noise, because the standard error would also be zero.

        Parameters
        ----------
        scene : Scene
            Scene of the fit.
        values : mapping of str to float or ndarray
            Outputs of the fit.

        Returns
        -------
        dict of {str: float}
            Scales by parameter name.
        """
        extent = abs(values["window_ends"] - values["window_begins"])
        sizes = dict.fromkeys(("b", "b1", "b2"), values.get("a", scene.a))
        sizes |= {"alpha": 1.0, "law_exponent": 1.0}
        sizes |= {"step_time": extent / values["velocity_before"]}
        sizes |= {f"trend{n}": scene.mu_star / extent**n for n in range(1, 6)}
        return {
            name: abs(values[name])
            + _NUMERICAL_ERROR_SCALE_PER_STDERR * values[f"{name}_stderr"]
            + sizes.get(strip_window_number(name), 0.0)
            for name in self.parameters
            if name in values
        }

    def describe(self) -> dict[str, Any]:
        """Return a description of the measure.

        Returns
        -------
        dict
            Name and options of the measure. The description contains hashes of the records instead
            of their data.
        """
        stated = {f.name: getattr(self, f.name) for f in fields(self)}
        records = {record.name: record.digest for record in self.records}
        return {"name": self.name, **stated, "free": list(self.free), "records": records}

    @classmethod
    def fields_from_description(cls, described: dict[str, Any], path: str) -> dict[str, Any]:
        """Raise ``InvalidValue``, because a fit cannot be restored without its records.

        Parameters
        ----------
        described : dict
            Description of the measure from a file.
        path : str
            Path of the file.

        Raises
        ------
        InvalidValue
            Always, because the description contains only hashes of the records.
        """
        rule = "are required for the fit, but the file contains only their digests"
        remedy = (
            "Fit the records again. To print the command that computed the fit, run "
            "rsfstudy show FILE."
        )
        raise InvalidValue("records", [*described["records"]], rule, remedy=remedy)

    @cached_property
    def _first_output_row_by_record(self) -> dict[Record, int]:
        """Index of the first output row of each fitted record."""
        records = [*dict.fromkeys(window.record for window in self._fitted_windows)]
        return {record: sum(map(len, records[:n])) for n, record in enumerate(records)}

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Fit the parameters, and compute their confidence intervals.

        Free parameters that do not occur in the friction law are not fitted.

        Parameters
        ----------
        scene : Scene
            Scene with the friction law and the fixed parameters.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Status, outputs and message of the fit.

        Raises
        ------
        MotionStopped
            If the fit fails, for example because a window has too few rows.
        """
        own = parameters_of_law(scene, self.free)
        if own != self.free:
            return self._insert_nan_for_absent_parameters(
                replace(self, free=own).compute(scene, integrator)
            )
        windows = self._fitted_windows
        search, found = self.solve(scene, integrator)
        part = search.model.window_models[0]
        apart = float(
            np.median(
                np.diff(part.load_point_displacement[part.time >= windows[0].loading_step.start])
            )
        )
        unidentified = find_unidentified_parameters(found, apart)
        outcome = self._build_outcome(search, found, unidentified, apart)
        if self.posterior:
            return posterior.add_posterior_draws(
                outcome, search, found, self.posterior, unidentified
            )
        return outcome

    def _build_outcome(
        self,
        search: FitProblem,
        found: FitSolution,
        unidentified: tuple[str, ...],
        displacement_per_row: float,
    ) -> Outcome:
        """Return the outcome of a fit without posterior draws."""
        windows = self._fitted_windows
        place = windows[0].window_summary_values
        rows = [
            window.record_row_indices + self._first_output_row_by_record[window.record]
            for window in windows
        ]
        values = self._collect_output_values(found, np.concatenate(rows), search.model)
        values |= place
        values["window_stiffness"] = found.parameter_values["stiffness"]
        values["window_stiffness_stderr"] = (
            search.stiffness_relative_stderr * found.parameter_values["stiffness"]
        )
        if len(windows) > 1:
            stresses = enumerate(windows, start=1)
            values |= {
                f"normal_stress_before_{n}": w.mean_normal_stress_before_step for n, w in stresses
            }
        ends = {
            name: search.compute_parameter_bounds(name)
            if name in unidentified
            else compute_confidence_interval(search, found, name)
            for name in self.parameters
        }
        for name, (low, high) in ends.items():
            values[f"{name}_ci_low"], values[f"{name}_ci_high"] = low, high
        if unidentified:
            is_least = (
                "a" in found.free_parameters
                and found.parameter_values["a"]
                < _DIRECT_EFFECT_BOUND_TOLERANCE_FACTOR * search.compute_parameter_bounds("a")[0]
            )
            text = describe_unidentified_parameters(
                found,
                unidentified,
                displacement_per_row,
                direct_effect_is_at_bound=is_least,
            )
            return Outcome(Status.NOT_IDENTIFIED, values, text)
        remarks = (
            describe_outliers(found.outlier_rows),
            describe_load_point_noise(found, self.loading, place["load_point_noise"]),
        )
        reasons = (
            *self.find_validity_problems(search, found),
            *describe_asymmetric_confidence_intervals(found, ends),
        )
        status = Status.ERRORS_NOT_VALID if reasons else Status.OK
        cuts = [cut for window in windows for cut in window.truncation_remarks]
        return Outcome(status, values, "; ".join(filter(None, (*reasons, *cuts, *remarks))))

    def solve(self, scene: Scene, integrator: Integrator) -> tuple[FitProblem, FitSolution]:
        """Fit the windows if all free parameters occur in the friction law.

        Parameters
        ----------
        scene : Scene
            Scene with the friction law and the fixed parameters.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        problem : FitProblem
            Least-squares problem for the model of all windows.
        solution : FitSolution
            Solution of the least-squares problem.

        Raises
        ------
        MotionStopped
            If the fit fails.
        """
        smooth = integrator.tightened_to(_MAX_RTOL_FOR_FINITE_DIFFERENCES)
        windows = self._fitted_windows
        per_um = self.machine_stiffness * self.slip_distance_guess
        scenes = [w.build_scene_with_machine_stiffness(scene, per_um) for w in windows]
        of_each = zip(windows, scenes, strict=True)
        parts = [w.create_window_model(one, self.free, self.loading, smooth) for w, one in of_each]
        parts = [replace(part, friction_filter=Filter.parse(self.filter)) for part in parts]
        if self.noise == WHITE_NOISE_NAME:  # The usual formula ignores the noise of the load point.
            parts = [replace(part, loadings_with_shifted_steps=()) for part in parts]
        distances = self.slip_distance_guess, self.slip_distance_2_guess
        first: dict[str, float] = {}
        for number, (part, window) in enumerate(zip(parts, windows, strict=True), start=1):
            guess = guess_initial_parameter_values(part, window.loading_step, self.free, distances)
            first = guess | first
            if len(windows) > 1:
                first |= {
                    f"{n}_{number}": v for n, v in guess.items() if is_per_window_parameter(n)
                }
        one_machine = self.machine_stiffness > 0.0 or "stiffness" in self.free
        model = JointWindowModel(
            tuple(parts), compute_stiffness_ratios_to_first_window(windows) if one_machine else ()
        )
        stderr = 0.0 if "stiffness" in self.free else self.stiffness_relative_stderr
        search = FitProblem(model, first, self.parameters, self.noise, stderr)
        return search, search.solve()

    def find_validity_problems(
        self, fit_problem: FitProblem, fit_solution: FitSolution
    ) -> tuple[str, ...]:
        """Return the reasons why the standard errors of a fit are not valid.

        Parameters
        ----------
        fit_problem : FitProblem
            Least-squares problem for the model of all windows.
        fit_solution : FitSolution
            Solution of the least-squares problem.

        Returns
        -------
        tuple of str
            Reasons why the standard errors are not valid. The tuple is empty if they are valid.
        """
        reasons = find_reasons_for_invalid_stderrs(
            fit_solution, fit_problem.model.recorded_friction
        )
        # With recorded loading, any filter would reduce the effect of load point noise, so the test
        # for a filter would be misleading.
        is_recorded = self.loading == "recorded"
        is_exact = fit_solution.noise_sd < MIN_FRICTION_NOISE_SD
        if (
            self.filter
            or is_recorded
            or is_exact
            or self.noise == WHITE_NOISE_NAME
            or is_friction_rounding_too_coarse(fit_solution)
        ):
            return reasons
        return (
            *detect_undeclared_filter(
                fit_solution, fit_problem.model.time_since_start_of_each_window, self.noise
            ),
            *reasons,
        )

    def _insert_nan_for_absent_parameters(self, output_values: Outcome) -> Outcome:
        """Insert NaN for parameters that do not occur in the friction law."""
        values = dict(output_values.values)
        has = np.array([name in values for name in self.parameters])
        before = np.cumsum(has)[~has]
        for name, axes in (("covariance", (0, 1)), ("correlation", (0, 1)), ("posterior", (1,))):
            for axis in axes if name in values else ():
                values[name] = np.insert(values[name], before, math.nan, axis=axis)
        return replace(output_values, values=values)

    def _collect_output_values(
        self, fit_solution: FitSolution, rows: np.ndarray, joint_model: JointWindowModel
    ) -> dict[str, OutputValue]:
        """Return all outputs of a fit except the confidence intervals."""
        values: dict[str, OutputValue] = {}
        for name in fit_solution.free_parameters:
            values[name], values[f"{name}_error"] = (
                fit_solution.parameter_values[name],
                fit_solution.parameter_numerical_errors[name],
            )
            values[f"{name}_stderr"] = fit_solution.compute_parameter_stderr(name)
        covariance = fit_solution.fit_coordinate_covariance * np.outer(
            fit_solution.parameter_derivatives_by_fit_coordinates,
            fit_solution.parameter_derivatives_by_fit_coordinates,
        )
        spread = np.sqrt(np.diag(covariance))
        signs = np.array(
            [float(n == "a") - (n in ("b", "b1", "b2")) for n in fit_solution.free_parameters]
        )
        with np.errstate(invalid="ignore"):
            correlation = covariance / np.outer(spread, spread)
            variance_of_rate = float(signs @ covariance @ signs)
        b = sum(fit_solution.parameter_values.get(name, 0.0) for name in ("b", "b1", "b2"))
        trend = joint_model.compute_friction_trend(fit_solution.parameter_values)
        variance = float(np.var(joint_model.recorded_friction)) or math.nan
        values |= {
            "a_minus_b": fit_solution.parameter_values["a"] - b,
            "a_minus_b_stderr": math.sqrt(max(variance_of_rate, 0.0)),
            "noise_sd": fit_solution.noise_sd,
            "outliers": len(fit_solution.outlier_rows),
            "friction_quantum": fit_solution.friction_rounding_quantum,
            "noise_order": fit_solution.noise_model.autoregressive_order,
            "n_eff": fit_solution.noise_model.effective_sample_size,
            "degrees_of_freedom": fit_solution.degrees_of_freedom,
            "p_value": compute_ljung_box_p_value(
                fit_solution.whitened_residuals, fit_solution.noise_model.autoregressive_order
            ),
            "r_squared": 1.0 - float(np.var(fit_solution.residuals)) / variance,
            "rows_fitted": len(rows),
            "aic": fit_solution.aic,
            "covariance": covariance,
            "correlation": correlation,
        }
        along = {
            "fitted_friction": fit_solution.model_friction + trend,
            "fitted_friction_stderr": fit_solution.fitted_friction_stderr,
            "detrended_friction": fit_solution.model_friction,
            "residual": fit_solution.residuals,
            "whitened_residual": fit_solution.whitened_residuals_with_nan_outliers,
        }
        for name in (about.name for about in RECORD_COLUMNS[:3]):
            whole = [record.columns[name] for record in self._first_output_row_by_record]
            along[f"record_{name}"] = np.concatenate(whole)
        for name, column in along.items():
            values[name] = along_rows = np.full(len(self.output_coordinates["row"]), math.nan)
            along_rows[slice(len(column)) if name.startswith("record_") else rows] = column
        return values
