"""Sequence of load point velocity steps between two velocities."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.loading import Loading, Segment
from rsfstudy.slider.parts import NON_NEGATIVE_INTEGER, POSITIVE, number


@dataclass(frozen=True, kw_only=True)
class VelocitySteps(Loading):
    r"""Alternating steps of the load point velocity between two values.

    The velocity alternates between :math:`V_*` and :math:`r V_*`. The load point displacement
    between successive steps is constant. After the last step, the velocity remains constant.

    Parameters
    ----------
    velocity_steps : float, default: 0.0
        Number of velocity steps.
    velocity_ratio : float, default: 10.0
        Load point velocity :math:`r` after the first step, in units of :math:`V_*`.
    displacement_between_steps : float, default: 20.0
        Load point displacement :math:`\Delta\delta_0` between successive steps, in :math:`D_c`.

    Notes
    -----
    The load point velocity is

    .. math::

        V_{\mathrm{load}}(t) = r V_* \text{ after steps } 1, 3, \ldots, \quad
          V_{\mathrm{load}}(t) = V_* \text{ after steps } 2, 4, \ldots
    """

    velocity_steps: float = number(
        0.0,
        "",
        "1",
        "number of load point velocity steps, alternately to the new velocity and back",
        rule=NON_NEGATIVE_INTEGER,
    )
    velocity_ratio: float = number(
        10.0,
        "$r$",
        "1",
        "load point velocity after the first step divided by V_star",
        rule=POSITIVE,
        remedy="If the first step should be a step down, use a value below 1. To hold the load "
        "point, set hold_time.",
    )
    displacement_between_steps: float = number(
        20.0,
        r"$\Delta\delta_0/D_c$",
        "1",
        "load point displacement from one step to the next",
        "D_c",
        rule=POSITIVE,
    )

    name = "velocity_steps"
    field_name_that_selects_part = "velocity_steps"

    @property
    def segments(self) -> tuple[Segment, ...]:
        """Segments of the loading, with one segment per step."""
        count, moves = int(self.velocity_steps), self.displacement_between_steps
        velocities = [1.0 if number_ % 2 else self.velocity_ratio for number_ in range(count)]
        lasts = [*(moves / velocity for velocity in velocities[:-1]), math.inf]
        return tuple(Segment(v, duration=t) for v, t in zip(velocities, lasts, strict=False))
