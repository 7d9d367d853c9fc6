"""Steppers of the event loop, and the base class of user-defined steppers.

The event loop calls the functions of this module, which call the methods of the stepper object. In
the compiled loop, the functions of ``order_eight`` replace the functions of this module. For each
regime, the loop first calls ``begin_integration_of_regime``. In each step, the loop calls
``attempt_step`` once, or ``step_to_segment_end`` if a loading segment ends in the step. After each
step, the loop may call ``interpolate_unknowns`` and ``retake_step`` any number of times.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

from rsfstudy._deprecation import add_former_member_names, copy_former_overrides_to_new_names
from rsfstudy.slider import EquationsOfMotion

#: Return values of ``Stepper.attempt_step`` if no step was taken: the step size is too small, or
#: the evaluation budget is exceeded.
NO_STEP, BUDGET_SPENT = 0.0, -1.0


@add_former_member_names
class Stepper(ABC):
    """Base class of steppers. A stepper integrates the equations of a motion.

    Each motion has its own stepper instance. The arguments ``motion`` and ``workspace`` of the
    methods contain the state of the motion. See ``array_layout.MOTION_STATE_DTYPE`` and
    ``workspace.Workspace``. A subclass must define the attribute ``name`` and all abstract methods.

    Parameters
    ----------
    systems : tuple of EquationsOfMotion
        Equations of each regime, indexed by ``motion.regime``.
    methods : mapping of str to str
        Names of integration methods for regimes. A stepper with a single method ignores this
        argument.

    Attributes
    ----------
    failure : str
        Reason why no step could be taken.
    """

    #: Name of the stepper in files and on the command line.
    name: ClassVar[str]

    def __init_subclass__(cls) -> None:
        """Add the new names of methods that the subclass defines under former names."""
        super().__init_subclass__()
        copy_former_overrides_to_new_names(cls)

    def __init__(self, systems: tuple[EquationsOfMotion, ...], methods: Mapping[str, str]) -> None:
        self.systems, self.failure = systems, "the step size became too small"

    @abstractmethod
    def begin_regime(self, motion: Any, workspace: Any) -> None:
        """Prepare the stepper for the integration of the current regime (``motion.regime``).

        The method reads the initial unknowns from ``workspace.y`` and must store their derivatives
        in ``workspace.rates``. The independent variable ``motion.clock`` is 0. After a kink of the
        loading, ``motion.next_step_length`` is the proposed step size. Otherwise,
        ``motion.next_step_length`` is 0.

        Parameters
        ----------
        motion : record
            State of the motion.
        workspace : Workspace
            Arrays of the regime.
        """

    @abstractmethod
    def attempt_step(self, motion: Any, workspace: Any, max_length: float) -> float:
        """Take one step whose local error is within the tolerance.

        The sign of ``motion.direction`` determines the direction of the step. The method must set
        ``workspace.y_end``, ``workspace.rates_at_end``, ``motion.end`` and ``motion.step_length``.
        The method must also call ``workspace.count_evaluations`` for its right-hand side
        evaluations.

        Parameters
        ----------
        motion : record
            State of the motion.
        workspace : Workspace
            Arrays of the regime.
        max_length : float
            Maximum step size.

        Returns
        -------
        float
            Size of the step, ``NO_STEP`` or ``BUDGET_SPENT``.
        """

    def step_to_segment_end(self, motion: Any, workspace: Any, approximate_length: float) -> float:
        """Take one step to the end of the loading segment.

        The default implementation takes no step and returns 0. The loop then calls ``attempt_step``
        and truncates the step.

        Parameters
        ----------
        motion : record
            State of the motion.
        workspace : Workspace
            Arrays of the regime.
        approximate_length : float
            Estimate of the step size.

        Returns
        -------
        float
            Size of the step, ``BUDGET_SPENT``, or 0 if no step was taken.
        """
        return 0.0

    @abstractmethod
    def interpolate_unknowns(
        self, motion: Any, workspace: Any, independent_variable: float
    ) -> None:
        """Interpolate the unknowns within the step, and store them in ``workspace.y_within``.

        Parameters
        ----------
        motion : record
            State of the motion.
        workspace : Workspace
            Arrays of the regime.
        independent_variable : float
            Value of the independent variable between the beginning and the end of the step.
        """

    @abstractmethod
    def retake_step(self, motion: Any, workspace: Any, independent_variable: float) -> None:
        """Repeat the step with an earlier end.

        The method must set the same fields as ``attempt_step``.

        Parameters
        ----------
        motion : record
            State of the motion.
        workspace : Workspace
            Arrays of the regime.
        independent_variable : float
            Independent variable at the new end of the step.
        """


def begin_integration_of_regime(motion, workspace):
    """Reset the independent variable, and prepare the stepper for a regime.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    """
    motion.clock = 0.0
    workspace.stepper.begin_regime(motion, workspace)


def attempt_step(motion, workspace, max_length):
    """Let the stepper take one step.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    max_length : float
        Maximum step size.

    Returns
    -------
    float
        Size of the step, ``NO_STEP`` or ``BUDGET_SPENT``.
    """
    return workspace.stepper.attempt_step(motion, workspace, max_length)


def step_to_segment_end(motion, workspace, approximate_length):
    """Let the stepper take one step to the end of the loading segment.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    approximate_length : float
        Estimate of the step size.

    Returns
    -------
    float
        Size of the step, ``BUDGET_SPENT``, or 0 if no step was taken.
    """
    return workspace.stepper.step_to_segment_end(motion, workspace, approximate_length)


def interpolate_unknowns(motion, workspace, independent_variable):
    """Let the stepper interpolate the unknowns within the step.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    independent_variable : float
        Value of the independent variable between the beginning and the end of the step.
    """
    workspace.stepper.interpolate_unknowns(motion, workspace, independent_variable)


def retake_step(motion, workspace, independent_variable):
    """Let the stepper repeat the step with an earlier end.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    independent_variable : float
        Independent variable at the new end of the step.
    """
    workspace.stepper.retake_step(motion, workspace, independent_variable)
