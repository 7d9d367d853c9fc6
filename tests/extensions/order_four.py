"""A user-defined stepper: the classical Runge-Kutta method.

Step doubling provides the error estimate.
"""

from __future__ import annotations

import math

import numpy as np

from rsfstudy import Accuracy, Axis, Scene, Study
from rsfstudy.measures import CriticalStep
from rsfstudy.motion.steppers import BUDGET_SPENT, NO_STEP, Stepper
from rsfstudy.motion.workspace import count_evaluations


class OrderFour(Stepper):
    name = "order_four"

    def begin_regime(self, motion, space):
        system = self.systems[motion.regime]
        self._rate, self._p, self._motion = system.rate_function, system.parameters, motion
        self._allowed = motion.tolerance * np.array(system.unknown_scales)
        self._length = 1e-3
        space.rates[: space.unknown_count] = self.rates(np.array(space.y[: space.unknown_count]))

    def attempt_step(self, motion, space, longest):
        y, first = (np.array(x[: space.unknown_count]) for x in (space.y, space.rates))
        length = min(self._length, longest)
        while True:
            towards = length * motion.direction
            if motion.clock + 0.1 * towards == motion.clock:
                self.failure = "the required step size is smaller than the spacing"
                return NO_STEP
            if motion.evaluations_slow + motion.evaluations_fast > motion.budget:
                return BUDGET_SPENT
            new, error = self.halves(y, first, towards)
            error = np.max(np.abs(error) / (self._allowed + motion.tolerance * np.abs(new)))
            factor = 0.9 * error**-0.2 if math.isfinite(error) and error > 0.0 else 0.2
            self._length = length * min(4.0, max(0.2, factor))
            if error <= 1.0:
                break
            length = self._length
        motion.step_length, motion.end = towards, motion.clock + towards
        space.y_end[: space.unknown_count] = new
        space.rates_at_end[: space.unknown_count] = self.rates(new)
        return length

    def interpolate_unknowns(self, motion, space, clock):
        """Interpolate with a cubic Hermite polynomial."""
        n, part = space.unknown_count, (clock - motion.clock) / motion.step_length
        y, new, first, last = (
            np.array(x[:n]) for x in (space.y, space.y_end, space.rates, space.rates_at_end)
        )
        line = (1.0 - part) * y + part * new
        bend = (1.0 - part) * (motion.step_length * first - new + y)
        bend += part * (new - y - motion.step_length * last)
        space.y_within[:n] = line + part * (1.0 - part) * bend

    def retake_step(self, motion, space, clock):
        n = space.unknown_count
        motion.step_length, motion.end = clock - motion.clock, clock
        y, first = np.array(space.y[:n]), np.array(space.rates[:n])
        new = self.halves(y, first, motion.step_length)[0]
        space.y_end[:n], space.rates_at_end[:n] = new, self.rates(new)

    def halves(self, y, first, length):
        """Return the result of two half steps, and the error estimate.

        The result has order five, and the error estimate has order four.
        """
        middle = self.step(y, first, 0.5 * length)
        twice = self.step(middle, self.rates(middle), 0.5 * length)
        error = (twice - self.step(y, first, length)) / 15.0
        return twice + error, error

    def step(self, y, first, length):
        second = self.rates(y + 0.5 * length * first)
        third = self.rates(y + 0.5 * length * second)
        fourth = self.rates(y + length * third)
        return y + length / 6.0 * (first + 2.0 * (second + third) + fourth)

    def rates(self, y):
        count_evaluations(self._motion, 1)
        return np.array(self._rate(tuple(y.tolist()), self._p))


study = Study(
    name="by_order_four",
    title="Critical steps by a stepper of order four",
    base=Scene(law="slip", normal_stress="constant"),
    axes=[Axis("b_over_a", [1.5, 2.0])],
    measure=CriticalStep(),
    accuracy=Accuracy(1e-4, engine=OrderFour),
)
