"""Interface of steppers for the loop of motions: to begin, to attempt a step, and values within it.

A stepper of one's own is a class derived from `Stepper`. The compiler has the functions of
`order_eight` in place of those below.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

from rsfstudy._deprecation import adopt_former_members, renamed_members
from rsfstudy.slider import Equations

#: What `Stepper.attempt` returns where it takes no step: none is long enough, or the budget is
#: spent.
NO_STEP, BUDGET_SPENT = 0.0, -1.0


@renamed_members
class Stepper(ABC):
    """Integrates the equations of a motion, one step at a time.

    A motion has a stepper of its own. What it knows of the motion stands in its state
    (`layout.MOTION`) and its workspace (`workspace.Workspace`), which are arguments of all methods.

    Parameters
    ----------
    systems : tuple of Equations
        The equations of the regimes that the motion goes through, by their numbers.
    methods : mapping of str to str
        Names of integrators by the names of regimes, for a stepper that has several.

    Attributes
    ----------
    failure : str
        Why no step could be taken.
    """

    #: What it is called in files and on the command line.
    name: ClassVar[str]

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        adopt_former_members(cls)

    def __init__(self, systems: tuple[Equations, ...], methods: Mapping[str, str]) -> None:
        self.systems, self.failure = systems, "no step is long enough"

    @abstractmethod
    def begin_regime(self, motion: Any, workspace: Any) -> None:
        """Begin with the unknowns ``workspace.y`` of the regime ``motion.regime``, at clock zero;
        fill in their rates, ``workspace.rates``. Where the loading has a kink,
        ``motion.next_step_length`` is that of the step it has cut short; elsewhere it is 0.
        """

    @abstractmethod
    def attempt_step(self, motion: Any, workspace: Any, max_length: float) -> float:
        """Take a step whose local error is allowed, in the direction of ``motion.direction``.

        Fills in ``workspace.y_end`` and ``workspace.rates_at_end``, the unknowns at its end and
        their rates, and ``motion.end`` and ``motion.step_length``, the clock there and the length.
        Each right-hand side is charged by ``workspace.count_evaluations``.

        Returns
        -------
        float
            Its length, or `NO_STEP`, or `BUDGET_SPENT`.
        """

    def step_to_segment_end(self, motion: Any, workspace: Any, approximate_length: float) -> float:
        """Take a step that ends when the segment of loading does, as `attempt` does; of about that
        length. A stepper that cannot returns 0.
        """
        return 0.0

    @abstractmethod
    def interpolate_unknowns(self, motion: Any, workspace: Any, clock: float) -> None:
        """Fill in ``workspace.y_within``, the unknowns at a clock within the step."""

    @abstractmethod
    def retake_step(self, motion: Any, workspace: Any, clock: float) -> None:
        """Take the step anew, to end at a clock within it."""


def begin_regime(motion, workspace):
    """Start the clock of the equations."""
    motion.clock = 0.0
    workspace.stepper.begin_regime(motion, workspace)


def attempt_step(motion, workspace, max_length):
    """Length of the step that could be taken; not positive where there is none."""
    return workspace.stepper.attempt_step(motion, workspace, max_length)


def step_to_segment_end(motion, workspace, approximate_length):
    """Length of a step that ends when the segment does; 0 where none could be taken."""
    return workspace.stepper.step_to_segment_end(motion, workspace, approximate_length)


def interpolate_unknowns(motion, workspace, clock):
    """Fill in the unknowns at a clock within the step."""
    workspace.stepper.interpolate_unknowns(motion, workspace, clock)


def retake_step(motion, workspace, clock):
    """Take the step anew, to a clock within it."""
    workspace.stepper.retake_step(motion, workspace, clock)
