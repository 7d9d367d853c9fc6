"""A loading history of a user's own, from a list of segments.

Its name stands for it in results, and its segments count for what decided the numbers.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from numbers import Real
from typing import Any

import numpy as np

from rsfstudy.error_boundary import error_boundary, guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.quantities import is_variable_name
from rsfstudy.slider.loading import Loading, Segment
from rsfstudy.slider.parameter_layout import SEGMENT_VELOCITY
from rsfstudy.slider.scene_view import SceneView

#: What a segment of a protocol may state.
SEGMENT_KEYS = ("velocity", "duration", "distance", "step", "normal_stress")


@guard_methods
@dataclass(frozen=True, kw_only=True)
class UserLoading(Loading, ABC):
    """Base of loading histories of a user's own, which are data.

    Attributes
    ----------
    name : str
        What stands for it in results.
    """

    name: str  # type: ignore[misc]  # of each, and not of the class

    def check(self, scene: SceneView) -> None:
        """A load point that moves back only where slip may; see `Loading`."""
        back = np.asarray(self.segment_table)[:, SEGMENT_VELOCITY] < 0.0
        if back.any() and not scene.parts.law.regularised:
            name, value, place = self.describe_reversal(int(np.argmax(back)))
            rule = "moves the load point back, and friction is that of forward slip"
            remedy = "Set regularised=True, by which slip reverses with shear stress."
            raise InvalidValue(name, value, rule, remedy=remedy).with_location(place)
        super().check(scene)

    def describe_reversal(self, index: int) -> tuple[str, float, str]:
        """Name and value of what was stated of a segment that moves back, and where."""
        return "velocity", self.segments[index].load_velocity, f"segment {index + 1}"

    @property
    @abstractmethod
    def duration(self) -> float:
        """Duration in D_c/V_* of all that was stated."""


@guard_methods
@dataclass(frozen=True, kw_only=True)
class Protocol(UserLoading):
    """A loading history as it was stated, segment by segment.

    Attributes
    ----------
    input_segments : tuple of Segment
        Its segments; the last may say how long it lasts.
    """

    input_segments: tuple[Segment, ...]

    def describe(self) -> dict[str, Any]:
        """Its segments as they were stated: the last may say how long it lasts."""
        return {"segments": [segment.as_dict() for segment in self.input_segments]}

    @cached_property
    def segments(self) -> tuple[Segment, ...]:
        """As they were stated, the last without end."""
        return *self.input_segments[:-1], self.input_segments[-1]._replace(duration=math.inf)

    @property
    def duration(self) -> float:
        """Duration in D_c/V_* of all segments that state one."""
        return math.fsum(s.duration for s in self.input_segments if s.duration < math.inf)


@error_boundary
def protocol(segments: Sequence[Segment | Mapping[str, float]], name: str = "protocol") -> Protocol:
    """A loading history of your own: ``Scene(loading=protocol([...]))``.

    Parameters
    ----------
    segments : sequence of Segment or mapping
        What the load point does, one segment after the other. A mapping states its ``velocity`` in
        V_* (below 0 it moves back, where the scene is `regularised`), and how long it lasts by its
        ``duration`` in D_c/V_* or its ``distance`` in D_c; a ``step`` is a sudden displacement of
        the load point in D_c at its beginning, and ``normal_stress`` what the rig imposes during
        it, over sigma_* (that of the segment before unless stated; 1 before the first). After the
        last one, which need not say how long it lasts, the load point goes on at that velocity.
    name : str
        What the protocol is called in results.

    Raises
    ------
    InvalidValue
        For a protocol without segments, a segment that lasts no time, has no normal stress, or says
        twice or not at all how long it lasts.
    """
    if not is_variable_name(name):
        raise InvalidValue("name", name, "must be a Python identifier: it names the protocol")
    if isinstance(segments, str | Mapping) or not isinstance(segments, Sequence):
        remedy = "Read a file by rsfstudy.read_protocol."
        raise InvalidValue("protocol", segments, "must be a list of segments", remedy=remedy)
    if not segments:
        remedy = 'State one at least, as in [{"velocity": 10}].'
        raise InvalidValue("protocol", segments, "has no segments", remedy=remedy)
    history: list[Segment] = []
    for number, stated in enumerate(segments, start=1):
        before = history[-1].normal_stress if history else 0.0
        history.append(_parse_segment(stated, before, f"segment {number}"))
    for number, segment in enumerate(history[:-1], start=1):
        if segment.duration == math.inf:
            remedy = "State its duration or its distance; only the last goes on for ever."
            raise InvalidValue("duration", math.inf, "never ends", remedy=remedy).with_location(
                f"segment {number}"
            )
    return Protocol(name=name, input_segments=tuple(history))


def _parse_segment(stated: Any, normal_stress: float, place: str) -> Segment:
    """A segment that is stated, after one with so much imposed normal stress."""
    try:
        if isinstance(stated, Segment):
            return _validated_segment(*stated)
        if not isinstance(stated, Mapping):
            remedy = 'Write {"velocity": 10, "duration": 2}.'
            raise InvalidValue("segment", stated, "is no segment", remedy=remedy)
        for key in stated:
            if key not in SEGMENT_KEYS:
                raise InvalidValue("segment", key, "is unknown", choices=SEGMENT_KEYS)
        if "normal_stress" in stated:
            normal_stress = (
                _read_positive(stated, "normal_stress", "greater than 0, and finite") - 1.0
            )
        velocity, duration = stated.get("velocity"), stated.get("duration", math.inf)
        if velocity is None:
            raise InvalidValue("velocity", None, "must be stated", remedy="0 holds the load point.")
        if "distance" in stated:
            distance = stated["distance"]
            if "duration" in stated:
                rule = f"give duration or distance (here {distance!r}), not both"
                raise InvalidValue("duration", duration, rule)
            distance = _read_positive(stated, "distance", "positive and finite")
            duration = distance / _read_positive(
                stated, "velocity", "positive where a distance is stated"
            )
        return _validated_segment(velocity, stated.get("step", 0.0), duration, normal_stress)
    except InvalidValue as error:
        raise error.with_location(place) from error


def _read_positive(stated: Mapping[str, Any], name: str, what: str) -> float:
    value = stated[name]
    if not (_is_number(value) and 0.0 < value < math.inf):
        raise InvalidValue(name, value, f"must be {what}")
    return float(value)


def _validated_segment(velocity: Any, step: Any, duration: Any, normal_stress: Any) -> Segment:
    if not _is_number(velocity) or not math.isfinite(velocity):
        remedy = "0 holds the load point."
        raise InvalidValue("velocity", velocity, "must be a finite number", remedy=remedy)
    if not _is_number(step) or not math.isfinite(step):
        raise InvalidValue("step", step, "must be a finite number")
    if not _is_number(duration) or not duration > 0.0:
        remedy = "Leave out what lasts no time."
        raise InvalidValue("duration", duration, "must be positive", remedy=remedy)
    if not _is_number(normal_stress) or not -1.0 < normal_stress < math.inf:
        rule = "must be greater than -1: it is what imposed normal stress exceeds sigma_* by"
        raise InvalidValue("normal_stress", normal_stress, rule)
    return Segment(float(velocity), float(step), float(duration), float(normal_stress))


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)
