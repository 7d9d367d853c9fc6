"""Protocols, which define a loading history by a list of segments.

The main function is ``protocol``. In results, a protocol is identified by its name. The segments
are stored in the provenance of the results.
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

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import (
    make_methods_raise_rsfstudy_errors,
    raise_only_rsfstudy_errors,
)
from rsfstudy.quantities import is_valid_variable_name
from rsfstudy.slider.loading import Loading, Segment
from rsfstudy.slider.parameter_layout import SEGMENT_VELOCITY
from rsfstudy.slider.scene_view import SceneView

#: Keys of a mapping that describes a segment.
SEGMENT_MAPPING_KEYS = ("velocity", "duration", "distance", "step", "normal_stress")


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True, kw_only=True)
class UserLoading(Loading, ABC):
    """Base class of protocols and sampled histories.

    Parameters
    ----------
    name : str
        Name of the loading in results.
    """

    name: str  # type: ignore[misc]  # The name belongs to the instance, not to the class.

    def check(self, scene: SceneView) -> None:
        """Check that the load point moves backwards only if slip may reverse.

        See ``Part.check``.
        """
        back = np.asarray(self.segment_table)[:, SEGMENT_VELOCITY] < 0.0
        if back.any() and not scene.parts.law.regularised:
            name, value, place = self.describe_load_point_reversal(int(np.argmax(back)))
            rule = "moves the load point backwards, but friction is defined for forward slip only"
            remedy = "Set regularised=True, which permits reversed slip."
            raise InvalidValue(name, value, rule, remedy=remedy).with_location(place)
        super().check(scene)

    def describe_load_point_reversal(self, segment_index: int) -> tuple[str, float, str]:
        """Describe the input value that moves the load point backwards.

        Parameters
        ----------
        segment_index : int
            Index of the segment.

        Returns
        -------
        name : str
            Name of the input quantity.
        value : float
            Input value.
        place : str
            Position of the value in the input.
        """
        return (
            "velocity",
            self.segments[segment_index].load_velocity,
            f"segment {segment_index + 1}",
        )

    @property
    @abstractmethod
    def duration(self) -> float:
        """Total duration of the segments or samples that the user passed, in D_c/V_*."""


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True, kw_only=True)
class Protocol(UserLoading):
    """Loading history that consists of user-defined segments.

    Parameters
    ----------
    name : str
        Name of the protocol in results.
    input_segments : tuple of Segment
        Segments of the protocol. The last segment may have a finite duration.
    """

    input_segments: tuple[Segment, ...]

    def describe(self) -> dict[str, Any]:
        """Return the input segments as plain data.

        See ``Loading.describe``. The duration of the last segment is included if this duration is
        finite.
        """
        return {"segments": [segment.as_dict() for segment in self.input_segments]}

    @cached_property
    def segments(self) -> tuple[Segment, ...]:
        """Segments of the loading. The last segment has no end."""
        return *self.input_segments[:-1], self.input_segments[-1]._replace(duration=math.inf)

    @property
    def duration(self) -> float:
        """Total duration of all segments whose duration is finite.

        The duration is in units of :math:`D_c/V_*`.
        """
        return math.fsum(s.duration for s in self.input_segments if s.duration < math.inf)


@raise_only_rsfstudy_errors
def protocol(segments: Sequence[Segment | Mapping[str, float]], name: str = "protocol") -> Protocol:
    r"""Create a loading history from a list of segments.

    After the last segment, the load point continues at the same velocity.

    Parameters
    ----------
    segments : sequence of Segment or mapping
        Segments in chronological order. A mapping has the following keys:

        - ``velocity`` is the load point velocity in :math:`V_*`. Negative values move the load
          point backwards, which requires a scene with ``regularised=True``.
        - ``duration`` is the duration in :math:`D_c/V_*`. Instead of ``duration``, you can pass
          ``distance``, the load point displacement in :math:`D_c`. Only the last segment may omit
          both ``duration`` and ``distance``.
        - ``step`` is a sudden displacement of the load point at the start of the segment, in
          :math:`D_c`. The default is 0.
        - ``normal_stress`` is the imposed normal stress in :math:`\sigma_*`. The default is the
          value of the previous segment, or 1 for the first segment.
    name : str, default: "protocol"
        Name of the protocol in results. The name must be a Python identifier.

    Returns
    -------
    Protocol
        Loading history for ``Scene(loading=...)``.

    Raises
    ------
    InvalidValue
        If there are no segments, or if a segment has an invalid duration, velocity or normal
        stress.

    Examples
    --------
    >>> import rsfstudy
    >>> test = rsfstudy.protocol(
    ...     [{"velocity": 10, "distance": 30}, {"velocity": 0, "duration": 100}, {"velocity": 1}]
    ... )
    >>> test.duration
    103.0
    >>> scene = rsfstudy.Scene(loading=test)
    >>> scene.load_velocity
    1.0
    """
    if not is_valid_variable_name(name):
        raise InvalidValue(
            "name", name, "must be a Python identifier, because it is the name of the protocol"
        )
    if isinstance(segments, str | Mapping) or not isinstance(segments, Sequence):
        remedy = "Read a file with rsfstudy.read_protocol."
        raise InvalidValue("protocol", segments, "must be a list of segments", remedy=remedy)
    if not segments:
        remedy = 'Pass, for example, [{"velocity": 10}].'
        raise InvalidValue("protocol", segments, "must have at least one segment", remedy=remedy)
    history: list[Segment] = []
    for number, stated in enumerate(segments, start=1):
        before = history[-1].normal_stress if history else 0.0
        history.append(_parse_segment(stated, before, f"segment {number}"))
    for number, segment in enumerate(history[:-1], start=1):
        if segment.duration == math.inf:
            remedy = "Set the duration or the distance of the segment."
            raise InvalidValue(
                "duration",
                math.inf,
                "must be finite, because only the last segment can have an infinite duration",
                remedy=remedy,
            ).with_location(f"segment {number}")
    return Protocol(name=name, input_segments=tuple(history))


def _parse_segment(
    declared_segment: Any, previous_normal_stress: float, segment_position_text: str
) -> Segment:
    """Convert an input segment to a validated ``Segment``.

    The argument ``previous_normal_stress`` is the normal stress of the previous segment, and
    ``segment_position_text`` is the position of the segment in error messages.
    """
    try:
        if isinstance(declared_segment, Segment):
            return _build_validated_segment(*declared_segment)
        if not isinstance(declared_segment, Mapping):
            remedy = 'Write, for example, {"velocity": 10, "duration": 2}.'
            raise InvalidValue(
                "segment", declared_segment, "must be a mapping or a Segment", remedy=remedy
            )
        for key in declared_segment:
            if key not in SEGMENT_MAPPING_KEYS:
                raise InvalidValue("key", key, "is unknown", choices=SEGMENT_MAPPING_KEYS)
        if "normal_stress" in declared_segment:
            previous_normal_stress = (
                _read_positive_number(
                    declared_segment, "normal_stress", "finite and greater than 0"
                )
                - 1.0
            )
        velocity, duration = (
            declared_segment.get("velocity"),
            declared_segment.get("duration", math.inf),
        )
        if velocity is None:
            raise InvalidValue(
                "velocity", None, "is required", remedy="Use 0 to hold the load point."
            )
        if "distance" in declared_segment:
            distance = declared_segment["distance"]
            if "duration" in declared_segment:
                rule = f"cannot be combined with distance = {distance!r}"
                remedy = "Omit one of the two."
                raise InvalidValue("duration", duration, rule, remedy=remedy)
            distance = _read_positive_number(declared_segment, "distance", "positive and finite")
            duration = distance / _read_positive_number(
                declared_segment, "velocity", "positive in a segment with a distance"
            )
        return _build_validated_segment(
            velocity, declared_segment.get("step", 0.0), duration, previous_normal_stress
        )
    except InvalidValue as error:
        raise error.with_location(segment_position_text) from error


def _read_positive_number(declared_segment: Mapping[str, Any], key: str, rule: str) -> float:
    """Return a value from a mapping, and check that the value is positive and finite."""
    value = declared_segment[key]
    if not (_is_real_number(value) and 0.0 < value < math.inf):
        raise InvalidValue(key, value, f"must be {rule}")
    return float(value)


def _build_validated_segment(
    velocity: Any, displacement_step: Any, duration: Any, normal_stress: Any
) -> Segment:
    """Validate the values of a segment, and return the ``Segment``."""
    if not _is_real_number(velocity) or not math.isfinite(velocity):
        raise InvalidValue("velocity", velocity, "must be a finite number")
    if not _is_real_number(displacement_step) or not math.isfinite(displacement_step):
        raise InvalidValue("step", displacement_step, "must be a finite number")
    if not _is_real_number(duration) or not duration > 0.0:
        remedy = "Remove segments with zero duration." if duration == 0.0 else ""
        raise InvalidValue("duration", duration, "must be a positive number", remedy=remedy)
    if not _is_real_number(normal_stress) or not -1.0 < normal_stress < math.inf:
        rule = "must be greater than -1, because it is the imposed normal stress minus sigma_*"
        raise InvalidValue("normal_stress", normal_stress, rule)
    return Segment(float(velocity), float(displacement_step), float(duration), float(normal_stress))


def _is_real_number(value: Any) -> bool:
    """Return True if a value is a real number but not a boolean."""
    return isinstance(value, Real) and not isinstance(value, bool)
