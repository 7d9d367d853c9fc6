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
    def begin(self, motion: Any, space: Any) -> None:
        """Begin with the unknowns ``space.y`` of the regime ``motion.regime``, at clock zero; fill
        in their rates, ``space.rates``. Where the loading has a kink, ``motion.next_step_length``
        is that of the step it has cut short; elsewhere it is 0.
        """

    @abstractmethod
    def attempt(self, motion: Any, space: Any, longest: float) -> float:
        """Take a step whose local error is allowed, in the direction of ``motion.direction``.

        Fills in ``space.y_end`` and ``space.rates_at_end``, the unknowns at its end and their
        rates, and ``motion.end`` and ``motion.step_length``, the clock there and the length. Each
        right-hand side is charged by ``workspace.count_evaluations``.

        Returns
        -------
        float
            Its length, or `NO_STEP`, or `BUDGET_SPENT`.
        """

    def step_to_segment_end(self, motion: Any, space: Any, length: float) -> float:
        """Take a step that ends when the segment of loading does, as `attempt` does; of about that
        length. A stepper that cannot returns 0.
        """
        return 0.0

    @abstractmethod
    def unknowns_at(self, motion: Any, space: Any, clock: float) -> None:
        """Fill in ``space.y_within``, the unknowns at a clock within the step, by dense output."""

    @abstractmethod
    def retake(self, motion: Any, space: Any, clock: float) -> None:
        """Take the step anew, to end at a clock within it."""


def begin(motion, space):
    """Start the clock of the equations."""
    motion.clock = 0.0
    space.stepper.begin(motion, space)


def attempt(motion, space, longest):
    """Length of the step that could be taken; not positive where there is none."""
    return space.stepper.attempt(motion, space, longest)


def step_to_segment_end(motion, space, length):
    """Length of a step that ends when the segment does; 0 where none could be taken."""
    return space.stepper.step_to_segment_end(motion, space, length)


def unknowns_at(motion, space, clock):
    """Fill in the unknowns at a clock within the step."""
    space.stepper.unknowns_at(motion, space, clock)


def retake(motion, space, clock):
    """Take the step anew, to a clock within it."""
    space.stepper.retake(motion, space, clock)
