"""Model of several windows that are fitted jointly.

In a joint fit, all windows have the same material parameters. Three parameters have a separate
value in each window: the friction before the step (``mu_star_1``, ``mu_star_2``, ...), the trend,
and the step time.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from scipy.linalg import block_diag

from rsfstudy.errors import InvalidValue
from rsfstudy.fitting.filters import LOW_PASS_ORDERS
from rsfstudy.fitting.window_model import (
    ACCURATE_DIFFERENCE_SCHEME,
    FiniteDifferenceScheme,
    ParameterValues,
    WindowModel,
    convert_fit_parameters_to_scene_fields,
    scene_to_parameters,
)
from rsfstudy.motion import MotionStopped
from rsfstudy.slider import Scene
from rsfstudy.status import Status

ParameterValueType = TypeVar("ParameterValueType")
#: Prefixes of the parameters that have a separate value in each window.
_PER_WINDOW_PARAMETER_PREFIXES = ("mu_star", "step_time", "trend")


def is_per_window_parameter(parameter_name: str) -> bool:
    """Return True if a parameter has a separate value in each window.

    Parameters
    ----------
    parameter_name : str
        Name of the parameter, with or without a window number.

    Returns
    -------
    bool
        True for the friction before the step, the step time and the trend coefficients.
    """
    return parameter_name.startswith(_PER_WINDOW_PARAMETER_PREFIXES)


def add_window_numbers_to_parameter_names(
    parameter_names: Sequence[str], window_count: int
) -> tuple[str, ...]:
    """Return the names of the parameters of a joint fit.

    Parameters
    ----------
    parameter_names : sequence of str
        Names of the parameters without window numbers.
    window_count : int
        Number of windows.

    Returns
    -------
    tuple of str
        Names of the shared parameters, followed by the numbered names for each window, such as
        ``mu_star_1`` and ``mu_star_2``. If there is a single window, the names are not numbered.
    """
    if window_count == 1:
        return tuple(parameter_names)
    own = [name for name in parameter_names if is_per_window_parameter(name)]
    each = [f"{name}_{number}" for number in range(1, window_count + 1) for name in own]
    return (*(name for name in parameter_names if not is_per_window_parameter(name)), *each)


def split_window_number(name: str) -> tuple[str, int]:
    """Split the name of a parameter into its base name and window number.

    Parameters
    ----------
    name : str
        Name of the parameter, such as "mu_star_2".

    Returns
    -------
    name : str
        Name without the window number.
    number : int
        Window number, or 0 if the name has no window number.

    Examples
    --------
    >>> from rsfstudy.fitting import split_window_number
    >>> split_window_number("mu_star_2")
    ('mu_star', 2)
    >>> split_window_number("slip_distance_2")
    ('slip_distance_2', 0)
    """
    before, _, number = name.rpartition("_")
    return (
        (before, int(number)) if number.isdecimal() and is_per_window_parameter(name) else (name, 0)
    )


def strip_window_number(name: str) -> str:
    """Remove the window number from the name of a parameter.

    Parameters
    ----------
    name : str
        Name of the parameter, such as "mu_star_2".

    Returns
    -------
    str
        Name without the window number.

    Examples
    --------
    >>> from rsfstudy.fitting import strip_window_number
    >>> strip_window_number("mu_star_2")
    'mu_star'
    """
    return split_window_number(name)[0]


def select_values_of_window(
    values_by_parameter_name: Mapping[str, ParameterValueType], window_number: int
) -> dict[str, ParameterValueType]:
    """Select the values of the parameters of a window.

    Parameters
    ----------
    values_by_parameter_name : mapping of str to object
        Values by parameter name, with or without window numbers.
    window_number : int
        Number of the window, starting from 1.

    Returns
    -------
    dict
        Values of the shared parameters, and of the parameters that are specific to the window. The
        names do not include window numbers.

    Examples
    --------
    >>> from rsfstudy.fitting.joint_window_model import select_values_of_window
    >>> select_values_of_window({"a": 0.01, "mu_star_1": 0.6, "mu_star_2": 0.62}, 2)
    {'a': 0.01, 'mu_star': 0.62}
    """
    names = {name: split_window_number(name) for name in values_by_parameter_name}
    return {
        own: values_by_parameter_name[name]
        for name, (own, of) in names.items()
        if of in (0, window_number)
    }


@dataclass(frozen=True)
class JointWindowModel:
    """Model of the friction in one or several windows.

    The class combines the rows of all windows, and has the same methods as ``WindowModel``.

    Parameters
    ----------
    window_models : tuple of WindowModel
        Models of the windows.
    stiffness_ratios_to_first_window : tuple of float, optional
        Ratio of stiffness to normal stress in each window, divided by the ratio in the first
        window. By default, all factors are 1.
    """

    window_models: tuple[WindowModel, ...]
    stiffness_ratios_to_first_window: tuple[float, ...] = ()

    @cached_property
    def time_since_start_of_each_window(self) -> np.ndarray:
        """Times of all rows in s, measured from the first row of each window."""
        return np.concatenate([part.time - part.time[0] for part in self.window_models])

    @cached_property
    def recorded_friction(self) -> np.ndarray:
        """Recorded friction of all rows, as a single array."""
        return np.concatenate([part.recorded_friction for part in self.window_models])

    @property
    def friction_averaging_time(self) -> float:
        """Averaging time of friction in s, or 0 if there is no averaging."""
        passed = self.window_models[0].friction_filter
        return (
            passed.averaging_time_or_frequency
            if passed is not None and passed.kind not in LOW_PASS_ORDERS
            else 0.0
        )

    @property
    def recorded_friction_per_window(self) -> list[np.ndarray]:
        """Recorded friction of the rows, as one array per window."""
        return [part.recorded_friction for part in self.window_models]

    @cached_property
    def load_point_displacement(self) -> np.ndarray:
        """Load point displacements of all rows in um, measured from the step."""
        return np.concatenate([part.load_point_displacement for part in self.window_models])

    def is_linear_in_parameter(self, parameter_name: str) -> bool:
        """Return True if friction is a linear function of a parameter.

        The method returns True only if friction is linear in the parameter for all values of the
        other parameters.

        Parameters
        ----------
        parameter_name : str
            Name of the parameter, with or without a window number.

        Returns
        -------
        bool
            True if friction is linear in all windows.
        """
        return all(
            part.is_linear_in_parameter(strip_window_number(parameter_name))
            for part in self.window_models
        )

    def find_longest_allowed_loading_delay(self, step_time_parameter_name: str) -> float:
        """Return the largest loading delay that the model supports.

        Parameters
        ----------
        step_time_parameter_name : str
            Name of the step time, with or without a window number.

        Returns
        -------
        float
            Largest delay of the loading in s, in the window whose step time has this name.
        """
        return self.window_models[
            max(split_window_number(step_time_parameter_name)[1] - 1, 0)
        ].longest_allowed_loading_delay

    def check_parameters_define_valid_scenes(self, parameter_values: ParameterValues) -> None:
        """Raise an error if the parameters do not define a valid scene.

        Parameters
        ----------
        parameter_values : mapping of str to float
            Values of all parameters.

        Raises
        ------
        MotionStopped
            If the scene of a window cannot be built from the parameters.
        """
        try:
            for part, own in self._iterate_window_models_with_values(parameter_values):
                part.build_scene(own)
        except InvalidValue as wrong:
            text = f"the first guess of the parameters is invalid: {wrong}"
            raise MotionStopped(Status.NOT_APPLICABLE, text) from wrong

    def compute_model_friction(
        self,
        parameter_values: ParameterValues,
        *,
        with_refined_tolerances: bool = False,
        require_stable: bool = False,
    ) -> np.ndarray:
        """Compute the friction of the model at each row of all windows.

        The friction does not include the trend. See ``WindowModel.compute_model_friction`` for
        details.

        Parameters
        ----------
        parameter_values : mapping of str to float
            Values of all parameters.
        with_refined_tolerances : bool, default: False
            If True, all tolerances are reduced by a factor of ten.
        require_stable : bool, default: False
            If True, the motion is computed only if the stiffness exceeds the critical stiffness.

        Returns
        -------
        ndarray, shape (rows,)
            Friction of the model. If the simulation of a window fails, the friction of the window
            is NaN.
        """
        told = {
            "with_refined_tolerances": with_refined_tolerances,
            "require_stable": require_stable,
        }
        return np.concatenate(
            [
                part.compute_model_friction(own, **told)
                for part, own in self._iterate_window_models_with_values(parameter_values)
            ]
        )

    def compute_friction_trend(self, parameter_values: ParameterValues) -> np.ndarray:
        """Compute the trend at each row of all windows.

        Parameters
        ----------
        parameter_values : mapping of str to float
            Values of all parameters.

        Returns
        -------
        ndarray, shape (rows,)
            Trend of each row.
        """
        return np.concatenate(
            [
                part.compute_friction_trend(own)
                for part, own in self._iterate_window_models_with_values(parameter_values)
            ]
        )

    def compute_jacobian(
        self,
        parameter_values: ParameterValues,
        free_parameters: Sequence[str],
        difference_scheme: FiniteDifferenceScheme = ACCURATE_DIFFERENCE_SCHEME,
    ) -> np.ndarray:
        """Compute the derivatives of friction with respect to parameters.

        See ``WindowModel.compute_jacobian`` for details.

        Parameters
        ----------
        parameter_values : mapping of str to float
            Values of all parameters.
        free_parameters : sequence of str
            Names of the free parameters, with window numbers.
        difference_scheme : (float, int), optional
            Step size and order of the finite differences. The default is
            ``ACCURATE_DIFFERENCE_SCHEME``.

        Returns
        -------
        ndarray, shape (rows, parameters)
            Derivatives of friction. The derivative with respect to a parameter of one window is 0
            in all other windows.
        """
        blocks = []
        places = {name: place for place, name in enumerate(free_parameters)}
        for number, (part, own) in enumerate(
            self._iterate_window_models_with_values(parameter_values), start=1
        ):
            acting = select_values_of_window(places, number)
            block = np.zeros((len(part.time), len(free_parameters)))
            block[:, [*acting.values()]] = part.compute_jacobian(own, [*acting], difference_scheme)
            blocks.append(block)
        return np.concatenate(blocks)

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
            Change in friction due to each independent error of the loading. The size of each error
            is one standard deviation. An error of the loading changes friction in one window only.
        """
        return np.asarray(
            block_diag(
                *(
                    part.compute_friction_change_by_loading_error(own)
                    for part, own in self._iterate_window_models_with_values(parameter_values)
                )
            )
        )

    def _iterate_window_models_with_values(
        self, parameter_values: ParameterValues
    ) -> Iterator[tuple[WindowModel, dict[str, float]]]:
        """Iterate over pairs of a window model and its parameter values."""
        factors = self.stiffness_ratios_to_first_window or (1.0,) * len(self.window_models)
        for number, (part, factor) in enumerate(
            zip(self.window_models, factors, strict=True), start=1
        ):
            own = select_values_of_window(parameter_values, number)
            yield part, own | {"stiffness": factor * own["stiffness"]}


def fitted_fields(
    scene: Scene,
    distances: Iterable[float],
    found: Mapping[str, float],
    stiffness: float | None,
    velocity: float,
) -> dict[str, float]:
    """Convert the fitted parameters of the first window to scene fields.

    Parameters
    ----------
    scene : Scene
        Scene with the initial values of the fit.
    distances : iterable of float
        Initial guesses of the slip distances in um.
    found : mapping of str to float
        Values of the fitted parameters.
    stiffness : float or None
        Stiffness of the window, or None if the stiffness was fitted.
    velocity : float
        Load point velocity before the step in um/s.

    Returns
    -------
    dict of str to float
        Values of the scene fields by name.

    Examples
    --------
    >>> from rsfstudy import Scene
    >>> from rsfstudy.fitting import fitted_fields
    >>> scene = Scene(a=0.01, b_over_a=1.3, stiffness=0.02)
    >>> fitted_fields(scene, [12.0, 12.0], {"a": 0.011}, None, 1.0)["a"]
    0.011
    """
    values = scene_to_parameters(scene, *distances)
    if stiffness is not None:
        values["stiffness"] = stiffness
    values |= {n: value for n, value in select_values_of_window(found, 1).items() if n in values}
    return convert_fit_parameters_to_scene_fields(values, velocity)
