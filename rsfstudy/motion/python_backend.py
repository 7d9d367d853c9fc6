"""Backend that runs the event loop in plain Python."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np

from rsfstudy._deprecation import add_former_member_names
from rsfstudy.motion import array_layout
from rsfstudy.motion.in_place_functions import build_in_place_functions
from rsfstudy.motion.motion_loop import advance_motion
from rsfstudy.slider import EquationsOfMotion


class PythonBackend:
    """Backend that runs the event loop in plain Python.

    The class ``compiled.numba_backend.NumbaBackend`` has the same methods.
    """

    def pack_initial_motion_state(
        self, field_values: tuple[tuple[str, float], ...]
    ) -> dict[str, float]:
        """Return the initial values of all fields of the motion state.

        Parameters
        ----------
        field_values : tuple of (str, float)
            Names and values of the fields with nonzero initial values.

        Returns
        -------
        dict of str to float
            Initial values.
        """
        return {
            **dict.fromkeys(array_layout.MOTION_STATE_DTYPE.names or (), 0),
            **dict(field_values),
        }

    def create_motion_state(
        self, initial_state: dict[str, float], values_set_by_caller: tuple[float, ...]
    ) -> PythonMotionState:
        """Create the state of a motion.

        Parameters
        ----------
        initial_state : dict of str to float
            Initial values of the fields, from ``pack_initial_motion_state``.
        values_set_by_caller : tuple of float
            Values of the fields in ``array_layout.MOTION_STATE_FIELDS_SET_BY_CALLER``.

        Returns
        -------
        PythonMotionState
            State of the motion.
        """
        called = zip(
            array_layout.MOTION_STATE_FIELDS_SET_BY_CALLER, values_set_by_caller, strict=True
        )
        return PythonMotionState(**{**initial_state, **dict(called)})

    def build_function_table(
        self, equations_by_regime: tuple[EquationsOfMotion, ...]
    ) -> np.ndarray:
        """Build the function table of the event loop.

        Parameters
        ----------
        equations_by_regime : tuple of EquationsOfMotion
            Equations of the slow manifold. If the scene has inertia, the second item contains the
            inertial equations of motion in ruptures.

        Returns
        -------
        ndarray of shape (2, FUNCTIONS_PER_REGIME)
            Functions that fill arrays, one row per regime. Both rows of the table contain the force
            balance function of the slow manifold.
        """
        rows = np.zeros((2, array_layout.FUNCTION_TABLE_COLUMN_COUNT), dtype=object)
        for row, system in zip(rows, equations_by_regime, strict=False):
            row[:] = build_in_place_functions(system)
        rows[array_layout.FAST_REGIME, -1] = rows[array_layout.SLOW_REGIME, -1]
        return rows

    def convert_arrays_for_motion_loop(self, *arrays: np.ndarray) -> Sequence[memoryview]:
        """Convert arrays to arguments of the event loop.

        Parameters
        ----------
        *arrays : ndarray
            Arrays that the loop reads or fills.

        Returns
        -------
        list of memoryview
            Memory views of the arrays. In Python, reading items of a memory view is faster than
            reading items of an array.
        """
        return [memoryview(array) for array in arrays]  # type: ignore[arg-type]

    def convert_parameters_for_motion_loop(self, parameters: Sequence[float]) -> Any:
        """Convert the parameters of a scene to an argument of the event loop.

        Parameters
        ----------
        parameters : sequence of float
            Parameters of the scene.

        Returns
        -------
        list of float
            Copy of the parameters.
        """
        return list(parameters)

    def get_motion_loop_function(self) -> Any:
        """Return the event loop.

        Returns
        -------
        callable
            The function ``motion_loop.advance_motion``.
        """
        return advance_motion


@partial(add_former_member_names, allow_assignment=True)
class PythonMotionState(SimpleNamespace):
    """State of a motion, stored in a Python object with the fields of ``MOTION_STATE_DTYPE``."""

    @property
    def motion_state_array(self) -> list[PythonMotionState]:
        """Value that the event loop receives as the argument ``motion_state_array``."""
        return [self]

    def get_evaluation_and_table_row_counts(self) -> tuple[int, ...]:
        """Return the counters of evaluations, steps and table rows.

        Returns
        -------
        tuple of int
            Right-hand side evaluations in the slow and in the fast regime, steps, event rows,
            recorded rows and Jacobians.
        """
        return (
            *(self.evaluations_slow, self.evaluations_fast, self.steps),
            *(self.event_rows, self.recorded_rows, self.jacobians),
        )

    def set_remaining_loading_kink_count(self, count: int) -> None:
        """Set the number of remaining kinks.

        Parameters
        ----------
        count : int
            Number of remaining kinks.
        """
        self.kinks_ahead = count

    def get_motion_state_field(self, field_name: str) -> float:
        """Return the value of a field of the motion state.

        Parameters
        ----------
        field_name : str
            Name of the field.

        Returns
        -------
        float
            Value of the field.
        """
        return float(getattr(self, field_name))
