"""Ramp of the load point velocity.

The load point velocity changes from :math:`V_*` at a steady rate and then remains constant.
"""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.loading import Loading, Segment
from rsfstudy.slider.parts import POSITIVE, POSITIVE_INTEGER, number


@dataclass(frozen=True, kw_only=True)
class VelocityRamp(Loading):
    r"""Ramp of the load point velocity, approximated by small steps.

    Parameters
    ----------
    velocity_ramp : float, default: 0.0
        Change :math:`\Delta V_0` of the load point velocity in :math:`V_*`.
    velocity_ramp_duration : float, default: 10.0
        Duration :math:`t_r` of the ramp in :math:`D_c/V_*`.
    velocity_ramp_stairs : float, default: 64.0
        Number :math:`n` of steps that approximate the ramp.

    Notes
    -----
    The load point velocity and its approximation by :math:`n` steps are

    .. math::

        V_{\mathrm{load}}(t) = V_* + \Delta V_0 \min(t/t_r, 1), \quad
          V_j = V_* + \Delta V_0 \frac{j - 1/2}{n}.

    The velocity :math:`V_j` is the mean velocity of the ramp during step :math:`j`, so the load
    point displacement is exact at the end of each step. The error of the approximation decreases
    with the square of :math:`n`.
    """

    velocity_ramp: float = number(
        0.0,
        r"$\Delta V_0/V_*$",
        "1",
        "change of load point velocity at a constant rate",
        "V_*",
        rule="must be -1 or greater",
        remedy="The value -1 stops the load point at the end of the ramp.",
    )
    velocity_ramp_duration: float = number(
        10.0,
        r"$t_r V_*/D_c$",
        "1",
        "duration of the change of load point velocity",
        "D_c/V_*",
        rule=POSITIVE,
    )
    velocity_ramp_stairs: float = number(
        64.0,
        "",
        "1",
        "number of steps that approximate a ramp of load point velocity",
        rule=POSITIVE_INTEGER,
    )

    name = "velocity_ramp"
    field_name_that_selects_part = "velocity_ramp"

    @property
    def segments(self) -> tuple[Segment, ...]:
        """One segment per velocity step, and the segment after the ramp."""
        count, change = int(self.velocity_ramp_stairs), self.velocity_ramp
        velocities = [1.0 + change * (stair + 0.5) / count for stair in range(count)]
        lasts = self.velocity_ramp_duration / count
        return (*(Segment(v, duration=lasts) for v in velocities), Segment(1.0 + change))
