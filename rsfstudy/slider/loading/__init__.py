"""What the load point does, one file a history.

A history is a sequence of segments. Before the first, the slider slides steadily at V_*.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from rsfstudy.slider.parts import Part, found_in


class Segment(NamedTuple):
    """A part of a loading history.

    Attributes
    ----------
    load_velocity : float
        V_0/V_* during the segment.
    displacement : float
        Sudden displacement of the load point at its beginning, in D_c.
    duration : float
        In D_c/V_*.
    """

    load_velocity: float
    displacement: float = 0.0
    duration: float = math.inf


@dataclass(frozen=True, kw_only=True)
class Loading(Part):
    """Base of the loading histories."""

    @property
    def segments(self) -> tuple[Segment, ...]:
        """The history; its last segment goes on for ever."""
        raise TypeError(f"{type(self).__name__} loads nothing")


PARTS = found_in(__name__, __path__)
