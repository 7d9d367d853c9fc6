"""Model of friction in a window of a record.

A ``WindowModel`` simulates the motion of a scene under the loading of a record. The method
``compute_model_friction`` computes friction at each row, and the method ``compute_jacobian``
computes the derivatives of friction with respect to the parameters.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.fitting.filters import Filter
from rsfstudy.motion import Integrator, MotionRecorder, MotionStopped
from rsfstudy.quantities import Quantity
from rsfstudy.slider import SampledHistory, Scene, replace_field_values
from rsfstudy.status import Status

#: Parameter values by name.
ParameterValues = Mapping[str, float]
#: Relative step size and order of a finite difference. The step size is relative to the scale of
#: the parameter. The order is 2 or 4.
FiniteDifferenceScheme = tuple[float, int]

#: Parameters that a fit may determine, by name.
PARAMETERS = {
    about.name: about
    for about in (
        Quantity("a", "$a$", "1", "direct effect parameter"),
        Quantity("b", "$b$", "1", "evolution effect parameter"),
        Quantity("b1", "$b_1$", "1", "evolution effect parameter of the first state"),
        Quantity("b2", "$b_2$", "1", "evolution effect parameter of the second state"),
        Quantity("slip_distance", "$D_c$", "um", "characteristic slip distance"),
        Quantity("slip_distance_2", "$D_{c2}$", "um", "slip distance of the second state"),
        Quantity("mu_star", r"$\mu_0$", "1", "friction coefficient before the first step"),
        Quantity("stiffness", "$k$", "um-1", "stiffness divided by normal stress"),
        Quantity(
            "alpha", r"$\alpha$", "1", "parameter of the normal stress effect on the state variable"
        ),
        Quantity("law_exponent", r"$\epsilon$", "1", "exponent of the family of laws"),
        Quantity("step_time", r"$\Delta t$", "s", "delay of the loading"),
        *(
            Quantity(
                f"trend{n}",
                rf"$\mathrm{{trend{n if n > 1 else ''}}}$",
                f"um-{n}",
                f"coefficient of power {n} of displacement in the trend",
            )
            for n in range(1, 6)
        ),
    )
}
#: Parameter names of other programs, and the corresponding names in rsfstudy.
PARAMETER_SYNONYMS = {
    **dict.fromkeys(("Dc", "dc", "D_c", "d_c", "L", "dcrit"), "slip_distance"),
    **dict.fromkeys(("Dc1", "L1"), "slip_distance"),
    **dict.fromkeys(("Dc2", "L2", "dc2"), "slip_distance_2"),
    **dict.fromkeys(("mu", "mu0", "mu_0", "f0", "f_0", "mu_ref"), "mu_star"),
    **dict.fromkeys(("k", "K", "kappa", "stiffness_ratio"), "stiffness"),
    **dict.fromkeys(("trend", "slope", "drift", "detrend"), "trend1"),
    **dict.fromkeys(("a_minus_b", "b_over_a"), "a and b, from which both quantities follow"),
    **dict.fromkeys(("eps", "epsilon"), "law_exponent, with law='family'"),
    **dict.fromkeys(("t0", "step"), "step_time"),
}
#: Parameters that only some friction laws have.
LAW_SPECIFIC_PARAMETERS = frozenset({"b", "b1", "b2", "slip_distance_2", "law_exponent"})
#: Names of the parameters that the fit varies on a logarithmic scale.
LOGARITHMIC_PARAMETERS = frozenset({"slip_distance", "slip_distance_2", "stiffness"})
#: Finite differences for the search and for the final solution. Simulated friction is reproducible
#: to 1e-11. The relative error of second-order differences is therefore 1e-5 if the motion is far
#: from unstable. The relative error of fourth-order differences is always less than 1e-6.
QUICK_DIFFERENCE_SCHEME, ACCURATE_DIFFERENCE_SCHEME = (3e-4, 2), (5e-3, 4)
#: Largest relative difference between the central differences with step sizes h and 2 h, and
#: largest number of tested step sizes. The relative error of the fourth-order difference is about
#: the square of the first value.
_DIFFERENCE_AGREEMENT_TOLERANCE, _MAX_DIFFERENCE_STEP_REDUCTIONS = 2e-4, 4
#: Shift of the time or velocity of a load point step for a finite difference, as a fraction of the
#: standard error of the time or velocity.
LOADING_STEP_SHIFT_OVER_STANDARD_ERROR = 0.01
#: Domains of bounded parameters. Near the ends of a domain, one-sided finite differences are used.
_PARAMETER_DOMAINS = {"law_exponent": (0.0, 1.0), "alpha": (0.0, math.inf)}
#: Scales of some parameters. The step size of a finite difference is proportional to the scale of
#: the parameter. The method ``WindowModel._find_typical_parameter_size`` computes the scales of all
#: other parameters.
_TYPICAL_PARAMETER_SIZES = {"mu_star": 0.6, "alpha": 0.5, "law_exponent": 1.0}
#: The largest number of right-hand-side evaluations of a simulation is the sum of three terms: a
#: constant, a number for each loading segment, and a number for a stiff spring, which has an upper
#: limit. The simulation of a motion that fits a record needs a few thousand evaluations, and about
#: 20 for each segment. A stiff spring needs about 2 k x/a evaluations, where k is the stiffness, x
#: is the displacement of the window, and a is the direct effect. The third term is twice this
#: number.
_MAX_EVALUATIONS, _MAX_EVALUATIONS_PER_SEGMENT, _MAX_EVALUATIONS_FOR_STIFF_SPRING = (
    50_000,
    60,
    100_000,
)


def check_free_parameters(free: Sequence[str]) -> None:
    """Raise ``InvalidValue`` if the names of free parameters are invalid.

    Parameters
    ----------
    free : sequence of str
        Names of the free parameters.

    Raises
    ------
    InvalidValue
        If there are no names, if a name is repeated, or if a name is not in ``PARAMETERS``.

    Examples
    --------
    >>> from rsfstudy.fitting import check_free_parameters
    >>> check_free_parameters(["a", "b", "slip_distance"])
    >>> check_free_parameters(["a", "b", "Dc"])
    Traceback (most recent call last):
        ...
    rsfstudy.errors.InvalidValue: ...
    """
    if not free:
        raise InvalidValue("free", tuple(free), "must contain at least one parameter name")
    if len(set(free)) < len(free):
        rule = "must not contain a parameter name more than once"
        raise InvalidValue("free", tuple(free), rule)
    for name in free:
        if name not in PARAMETERS:
            remedy = f"Write {PARAMETER_SYNONYMS[name]}." if name in PARAMETER_SYNONYMS else ""
            raise InvalidValue(
                "free",
                name,
                "must only contain names of parameters",
                choices=PARAMETERS,
                remedy=remedy,
            )


def parameters_of_law(scene: Scene, free: Sequence[str]) -> tuple[str, ...]:
    """Select the parameters that occur in the friction law of a scene.

    Parameters
    ----------
    scene : Scene
        Scene with a friction law.
    free : sequence of str
        Names of parameters.

    Returns
    -------
    tuple of str
        Names from ``free`` without the parameters of other friction laws. For example, a law with
        one state variable has ``b``, and a law with two state variables has ``b1``, ``b2`` and
        ``slip_distance_2``.

    Examples
    --------
    >>> from rsfstudy import Scene
    >>> from rsfstudy.fitting import parameters_of_law
    >>> parameters_of_law(Scene(law="slip"), ("a", "b", "b1", "b2", "slip_distance"))
    ('a', 'b', 'slip_distance')
    """
    own = scene_to_parameters(scene, 1.0, 1.0)
    return tuple(name for name in free if name in own or name.startswith(("trend", "step_time")))


def check_fields_positive(instance: object, *field_names: str) -> None:
    """Raise ``InvalidValue`` if an attribute of an object is not positive.

    Parameters
    ----------
    instance : object
        Object with the attributes.
    *field_names : str
        Names of the attributes.

    Raises
    ------
    InvalidValue
        If an attribute is not positive and finite.
    """
    for name in field_names:
        if not 0.0 < getattr(instance, name) < math.inf:
            raise InvalidValue(name, getattr(instance, name), "must be positive and finite")


@dataclass(frozen=True)
class WindowModel:
    """Model of friction in a window of a record.

    Parameters
    ----------
    scene : Scene
        Scene with the friction law and the fixed parameters.
    time, load_point_displacement, recorded_friction : ndarray, shape (rows,)
        Times of the rows in s, load point displacements since the first step in um, and recorded
        friction.
    loading_segments : ndarray, shape (segments, 4)
        Loading history (see ``rsfstudy.fitting.recorded_loading.build_loading_history``).
    integrator : Integrator
        Integrator with the requested accuracy.
    loadings_with_shifted_steps : sequence of ndarray, optional
        Loading histories with shifted step times and velocities (see
        ``rsfstudy.fitting.load_point_noise.copy_steps_shifted_by_their_errors``).
    friction_filter : Filter, optional
        Filter that was applied to friction before it was recorded.
    """

    scene: Scene
    time: np.ndarray
    load_point_displacement: np.ndarray
    recorded_friction: np.ndarray
    loading_segments: np.ndarray
    integrator: Integrator
    loadings_with_shifted_steps: Sequence[np.ndarray] = ()
    friction_filter: Filter | None = None

    @property
    def initial_velocity(self) -> float:
        """Load point velocity in um/s at the beginning of the window."""
        return float(self.loading_segments[0, 1])

    @cached_property
    def has_normal_stress_change(self) -> bool:
        """True if the normal stress changes."""
        return bool(np.ptp(self.loading_segments[:, 2]) > 0.0 or self.loading_segments[:, 3].any())

    def is_linear_in_parameter(self, parameter_name: str) -> bool:
        """Return True if friction is a linear function of a parameter.

        The method returns True only if friction is linear in the parameter for all values of the
        other parameters.

        Parameters
        ----------
        parameter_name : str
            Name of the parameter.

        Returns
        -------
        bool
            True for trend coefficients, and for ``mu_star`` if the normal stress is constant.
        """
        return parameter_name.startswith("trend") or (
            parameter_name == "mu_star" and not self.has_normal_stress_change
        )

    @property
    def longest_allowed_loading_delay(self) -> float:
        """Largest loading delay in s that the model supports."""
        return float(self.time[0] - self.loading_segments[0, 0])

    def build_scene(self, parameter_values: ParameterValues) -> Scene:
        """Build the scene of the window from parameter values.

        Parameters
        ----------
        parameter_values : mapping of str to float
            Values of all parameters, in the units of ``PARAMETERS``.

        Returns
        -------
        Scene
            Scene that is dimensionless with respect to the slip distance and the initial load point
            velocity.

        Raises
        ------
        InvalidValue
            If a parameter is outside its domain.
        """
        distance, velocity = parameter_values["slip_distance"], self.initial_velocity
        columns = np.empty((len(self.loading_segments), 4))
        columns[:, 0] = (
            (self.loading_segments[:, 0] - self.loading_segments[0, 0]) * velocity / distance
        )
        columns[:, 1] = self.loading_segments[:, 1] / velocity
        columns[:, 2] = 1.0 - self.loading_segments[:, 2]
        columns[:, 3] = self.loading_segments[:, 3] * distance / velocity
        history = SampledHistory.from_table(columns, self.has_normal_stress_change, "record")
        parts = self.scene.parts._replace(loading=history)
        return Scene(
            replace_field_values(
                parts, convert_fit_parameters_to_scene_fields(parameter_values, velocity)
            )
        )

    def compute_model_friction(
        self,
        parameter_values: ParameterValues,
        *,
        with_refined_tolerances: bool = False,
        require_stable: bool = False,
    ) -> np.ndarray:
        """Compute the friction of the model at each row, without the trend.

        The motion starts from steady sliding before the first step. As in an experiment, friction
        is the spring stress divided by the normal stress. The parameter ``step_time`` is a delay of
        the loading. The delay is subtracted from the times at which the simulated motion is
        evaluated.

        Parameters
        ----------
        parameter_values : mapping of str to float
            Values of all parameters, in the units of ``PARAMETERS``.
        with_refined_tolerances : bool, default: False
            If True, all tolerances are reduced by a factor of ten.
        require_stable : bool, default: False
            If True, the motion is computed only if the stiffness exceeds the critical stiffness and
            the second slip distance is longer than the first slip distance.

        Returns
        -------
        ndarray, shape (rows,)
            Friction of the model. All values are NaN if the simulation fails. All values are also
            NaN if the simulation needs far more evaluations than usual, because such a motion is
            unlikely to fit a record.

        Raises
        ------
        MotionStopped
            If the work budget is exhausted.
        """
        budget, nothing = self.integrator.work_meter.budget, np.full(len(self.time), math.nan)
        stiff = (
            4.0
            * parameter_values["stiffness"]
            * float(np.ptp(self.load_point_displacement))
            / parameter_values["a"]
        )
        most = (
            _MAX_EVALUATIONS
            + _MAX_EVALUATIONS_PER_SEGMENT * len(self.loading_segments)
            + int(min(stiff, _MAX_EVALUATIONS_FOR_STIFF_SPRING))
        )
        try:
            scene = self.build_scene(parameter_values)
            swapped = (
                parameter_values.get("slip_distance_2", math.inf)
                <= parameter_values["slip_distance"]
            )
            if require_stable and (swapped or not scene.stiffness > scene.critical_stiffness):
                return nothing
            late = parameter_values.get("step_time", 0.0)
            scale = self.initial_velocity / parameter_values["slip_distance"]
            times = (
                self.friction_filter.compute_required_sample_times(self.time)
                if self.friction_filter
                else self.time
            )
            at = np.maximum(times - late - self.loading_segments[0, 0], 0.0) * scale
            integrator = self.integrator.refined() if with_refined_tolerances else self.integrator
            recording, end = MotionRecorder(sample_times=at), float(at[-1]) * (1.0 + 1e-12)
            self.integrator.work_meter.budget = min(budget, self.integrator.evaluations + most)
            for _event in integrator.follow(scene, recording=recording, until=end):
                pass
        except MotionStopped as halt:
            if (
                halt.status is Status.WORK_BUDGET_SPENT
                and self.integrator.work_meter.budget == budget
            ):
                raise
            return nothing
        except InvalidValue:
            return nothing
        finally:
            self.integrator.work_meter.budget = budget
        found = MotionRecorder.get_friction_coefficient(recording.as_table(scene))
        if len(found) != len(times):
            return nothing
        return self.friction_filter.apply(self.time, found) if self.friction_filter else found

    def compute_friction_trend(self, parameter_values: ParameterValues) -> np.ndarray:
        r"""Compute the trend at each row.

        Parameters
        ----------
        parameter_values : mapping of str to float
            Values of all parameters. The coefficient ``trend<n>`` has the unit um^-n.

        Returns
        -------
        ndarray, shape (rows,)
            Trend :math:`c_1 x + c_2 x^2 + \dots` for the displacement :math:`x` from the first step
            in um.
        """
        powers = [
            (int(name[5:]), c) for name, c in parameter_values.items() if name.startswith("trend")
        ]
        return sum(
            (c * self.load_point_displacement**n for n, c in powers), np.zeros(len(self.time))
        )

    def compute_friction_change_by_loading_error(
        self, parameter_values: ParameterValues
    ) -> np.ndarray:
        """Compute the changes in friction due to loading errors.

        Parameters
        ----------
        parameter_values : mapping of str to float
            Values of all parameters.

        Returns
        -------
        ndarray, shape (rows, errors)
            Change in friction due to each independent error of the steps. The size of each error is
            one standard deviation. The values are NaN if a simulation fails.
        """
        if not self.loadings_with_shifted_steps:
            return np.zeros((len(self.time), 0))
        curves = [
            replace(self, loading_segments=moved).compute_model_friction(parameter_values)
            for moved in self.loadings_with_shifted_steps
        ]
        return (
            np.asarray(np.array(curves) - self.compute_model_friction(parameter_values)).T
            / LOADING_STEP_SHIFT_OVER_STANDARD_ERROR
        )

    def compute_jacobian(
        self,
        parameter_values: ParameterValues,
        free_parameters: Sequence[str],
        difference_scheme: FiniteDifferenceScheme = ACCURATE_DIFFERENCE_SCHEME,
    ) -> np.ndarray:
        r"""Compute the derivatives of friction with respect to parameters.

        For the parameters in ``LOGARITHMIC_PARAMETERS``, the derivatives are with respect to the
        logarithm of the parameter.

        Parameters
        ----------
        parameter_values : mapping of str to float
            Values of all parameters.
        free_parameters : sequence of str
            Names of the free parameters.
        difference_scheme : (float, int), optional
            Relative step size and order of the finite difference. The default is
            ``ACCURATE_DIFFERENCE_SCHEME``.

        Returns
        -------
        ndarray, shape (rows, parameters)
            Derivatives of friction. A column is NaN if a simulation for its finite difference
            fails.

        Notes
        -----
        The derivatives with respect to trends are exact. If the normal stress is constant, the
        derivative with respect to ``mu_star`` is also exact. All other derivatives are central
        differences of simulated motions,

        .. math:: d(h) = \frac{f(p + h) - f(p - h)}{2 h},

        or the fourth-order combination :math:`[4 d(h) - d(2 h)]/3`. The step size :math:`h` is
        reduced until :math:`d(h)` and :math:`d(2 h)` agree.
        """
        return np.column_stack(
            [
                self._compute_friction_derivative(parameter_values, name, difference_scheme)
                for name in free_parameters
            ]
        )

    def _compute_friction_derivative(
        self,
        parameter_values: ParameterValues,
        parameter_name: str,
        difference_scheme: FiniteDifferenceScheme,
    ) -> np.ndarray:
        """Compute the derivative of friction with respect to a parameter."""
        if parameter_name.startswith("trend"):
            return np.asarray(self.load_point_displacement ** int(parameter_name[5:]))
        if self.is_linear_in_parameter(parameter_name):
            return np.ones(len(self.time))
        (part, order), size = (
            difference_scheme,
            self._find_typical_parameter_size(parameter_name, parameter_values),
        )
        if order == 2:
            return self._compute_central_difference(
                parameter_values, parameter_name, part * size, 2.0, with_refined_tolerances=False
            )
        best, least = np.full(len(self.time), math.nan), math.inf
        for _ in range(_MAX_DIFFERENCE_STEP_REDUCTIONS):
            near, far = (
                self._compute_central_difference(
                    parameter_values, parameter_name, n * part * size, 4.0 / n
                )
                for n in (1.0, 2.0)
            )
            largest = float(np.abs(near).max()) or 1.0
            apart = float(np.abs(far - near).max()) / largest
            if apart >= least:  # Rounding errors dominate the finite difference.
                break
            if math.isfinite(apart):
                best, least = (4.0 * near - far) / 3.0, apart
            if least < _DIFFERENCE_AGREEMENT_TOLERANCE:
                break
            part *= (
                max(0.8 * math.sqrt(_DIFFERENCE_AGREEMENT_TOLERANCE / least), 0.03)
                if least < math.inf
                else 0.1
            )
        return best

    def _compute_central_difference(
        self,
        parameter_values: ParameterValues,
        parameter_name: str,
        step_size: float,
        min_steps_from_domain_end: float,
        *,
        with_refined_tolerances: bool = True,
    ) -> np.ndarray:
        """Compute a second-order finite difference.

        The difference is one-sided if the distance of the parameter from an end of its domain is
        less than ``min_steps_from_domain_end`` step sizes.
        """
        low, high = _PARAMETER_DOMAINS.get(parameter_name, (-math.inf, math.inf))
        weights = {1.0: 0.5, -1.0: -0.5}
        if (
            not low + min_steps_from_domain_end * step_size
            <= parameter_values[parameter_name]
            <= high - min_steps_from_domain_end * step_size
        ):
            side = (
                1.0
                if parameter_values[parameter_name] < low + min_steps_from_domain_end * step_size
                else -1.0
            )
            weights = {0.0: -1.5 * side, side: 2.0 * side, 2.0 * side: -0.5 * side}
        found = np.zeros(len(self.time))
        for place, weight in weights.items():
            moved = shift_parameter(parameter_values, parameter_name, place * step_size)
            found += (
                weight
                / step_size
                * self.compute_model_friction(
                    moved, with_refined_tolerances=with_refined_tolerances
                )
            )
        return found

    def _find_typical_parameter_size(
        self, parameter_name: str, parameter_values: ParameterValues
    ) -> float:
        """Return the scale that determines the finite-difference step size of a parameter."""
        if parameter_name in LOGARITHMIC_PARAMETERS:
            return 1.0
        if parameter_name == "a":
            return parameter_values["a"]
        if parameter_name.startswith("b"):
            return max(parameter_values["a"], abs(parameter_values[parameter_name]))
        return _TYPICAL_PARAMETER_SIZES.get(parameter_name, 1.0 / self.initial_velocity)


def scene_to_parameters(scene: Scene, distance: float, distance_2: float) -> dict[str, float]:
    """Convert dimensionless scene fields to fit parameters with units.

    Parameters
    ----------
    scene : Scene
        Scene with lengths in units of its slip distance.
    distance : float
        Slip distance of the scene in um.
    distance_2 : float
        Slip distance of the second state variable in um. If the friction law has one state
        variable, the value is ignored.

    Returns
    -------
    dict of {str: float}
        Values of the parameters, in the units of ``PARAMETERS``.

    Examples
    --------
    >>> from rsfstudy import Scene
    >>> from rsfstudy.fitting import scene_to_parameters
    >>> scene = Scene(a=0.01, b_over_a=1.5, mu_star=0.6, stiffness=0.02)
    >>> values = scene_to_parameters(scene, 10.0, 100.0)
    >>> {name: round(values[name], 6) for name in ("a", "b", "stiffness")}
    {'a': 0.01, 'b': 0.015, 'stiffness': 0.002}
    """
    stated = scene.as_dict()
    found = {
        "a": scene.a,
        "slip_distance": distance,
        "mu_star": scene.mu_star,
        "stiffness": scene.stiffness / distance,
    }
    if scene.parts.law.state_count == 1:
        found["b"] = scene.b
    else:
        found |= {name: scene.a * stated[f"{name}_over_a"] for name in ("b1", "b2")}
        found["slip_distance_2"] = distance_2
    named = ("alpha", "law_exponent")
    return found | {name: stated[name] for name in named if stated.get(name) is not None}


def convert_fit_parameters_to_scene_fields(
    parameter_values: ParameterValues, velocity_unit: float
) -> dict[str, float]:
    """Convert fit parameters with units to dimensionless scene fields.

    Parameters
    ----------
    parameter_values : mapping of str to float
        Values of the parameters, in the units of ``PARAMETERS``.
    velocity_unit : float
        Load point velocity in um/s, which is the unit of velocity in the scene.

    Returns
    -------
    dict of {str: float}
        Scene fields, with the slip distance and ``velocity_unit`` as units.

    Examples
    --------
    >>> from rsfstudy.fitting.window_model import convert_fit_parameters_to_scene_fields
    >>> values = {"a": 0.01, "b": 0.015, "slip_distance": 10.0, "mu_star": 0.6, "stiffness": 0.002}
    >>> fields = convert_fit_parameters_to_scene_fields(values, velocity_unit=1.0)
    >>> {name: round(fields[name], 6) for name in ("stiffness", "reference_rate", "b_over_a")}
    {'stiffness': 0.02, 'reference_rate': 0.1, 'b_over_a': 1.5}
    """
    a, distance = parameter_values["a"], parameter_values["slip_distance"]
    fields = {
        "a": a,
        "mu_star": parameter_values["mu_star"],
        "stiffness": parameter_values["stiffness"] * distance,
        "reference_rate": velocity_unit / distance,
    }
    fields |= {
        f"{n}_over_a": parameter_values[n] / a for n in ("b", "b1", "b2") if n in parameter_values
    }
    if "slip_distance_2" in parameter_values:
        fields["length_ratio"] = parameter_values["slip_distance_2"] / distance
    return fields | {
        name: parameter_values[name]
        for name in ("alpha", "law_exponent")
        if name in parameter_values
    }


def shift_parameter(
    parameter_values: ParameterValues, parameter_name: str, fit_coordinate_change: float
) -> dict[str, float]:
    """Shift the value of one parameter.

    Parameters
    ----------
    parameter_values : mapping of str to float
        Values of all parameters.
    parameter_name : str
        Name of the parameter to shift.
    fit_coordinate_change : float
        Change in the parameter, or in its logarithm for parameters in ``LOGARITHMIC_PARAMETERS``.

    Returns
    -------
    dict of {str: float}
        Values of all parameters, including the shifted parameter.
    """
    moved = (
        parameter_values[parameter_name] * math.exp(fit_coordinate_change)
        if parameter_name in LOGARITHMIC_PARAMETERS
        else parameter_values[parameter_name] + fit_coordinate_change
    )
    return {**parameter_values, parameter_name: moved}


def convert_parameter_to_fit_coordinate(parameter_name: str, parameter_value: float) -> float:
    """Convert the value of a parameter to its fit coordinate.

    Parameters
    ----------
    parameter_name : str
        Name of the parameter.
    parameter_value : float
        Value of the parameter.

    Returns
    -------
    float
        Logarithm of the value for parameters in ``LOGARITHMIC_PARAMETERS``, and the value itself
        for all other parameters.
    """
    return (
        math.log(parameter_value) if parameter_name in LOGARITHMIC_PARAMETERS else parameter_value
    )


def convert_fit_coordinate_to_parameter(parameter_name: str, fit_coordinate: float) -> float:
    """Convert a fit coordinate of a parameter to the value of the parameter.

    Parameters
    ----------
    parameter_name : str
        Name of the parameter.
    fit_coordinate : float
        Logarithm of the parameter for parameters in ``LOGARITHMIC_PARAMETERS``, and the value
        itself for all other parameters.

    Returns
    -------
    float
        Value of the parameter.
    """
    return math.exp(fit_coordinate) if parameter_name in LOGARITHMIC_PARAMETERS else fit_coordinate


def compute_derivative_by_fit_coordinate(parameter_name: str, parameter_value: float) -> float:
    """Compute the derivative of a parameter with respect to its fit coordinate.

    Parameters
    ----------
    parameter_name : str
        Name of the parameter.
    parameter_value : float
        Value of the parameter.

    Returns
    -------
    float
        Value of the parameter for parameters in ``LOGARITHMIC_PARAMETERS``, and 1 for all other
        parameters.
    """
    return parameter_value if parameter_name in LOGARITHMIC_PARAMETERS else 1.0
