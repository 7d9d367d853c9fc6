"""Loading histories of the load point, one file each.

A history is a sequence of segments. Before the first, the slider slides steadily at V_*.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from rsfstudy._deprecation import renamed_members
from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.slider.parts import NON_NEGATIVE, Numbers, Part, discover_parts, number
from rsfstudy.slider.requirements import SLIP_RATE
from rsfstudy.slider.scene_view import SceneView

#: Duration of a segment in D_c/V_* below which no step of an integrator is taken; from a time of 1
#: on rounding is longer.
MIN_SEGMENT_DURATION = 1e-16


@guard_methods
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
    normal_stress : float
        By how much imposed normal stress exceeds sigma_* during the segment, over sigma_*. Where a
        driving stress is inclined to the fault, that is a change of sigma_3, to which what shear
        stress brings is added.
    """

    load_velocity: float
    displacement: float = 0.0
    duration: float = math.inf
    normal_stress: float = 0.0

    def as_dict(self) -> dict[str, float]:
        """The segment as `protocol` takes it."""
        stated = {"velocity": self.load_velocity}
        if self.displacement:
            stated["step"] = self.displacement
        if self.duration < math.inf:
            stated["duration"] = self.duration
        if self.normal_stress:
            stated["normal_stress"] = 1.0 + self.normal_stress
        return stated


@renamed_members
@guard_methods
@dataclass(frozen=True, kw_only=True)
class Loading(Part):
    """Base of the loading histories.

    What one writes, in a frozen dataclass whose fields are made by `rsfstudy.slider.parts.number`::

        name: ClassVar[str]
        segments: property -> tuple[Segment, ...]

    ``Segment(load_velocity, displacement=0, duration=inf, normal_stress=0)`` is in V_*, D_c,
    D_c/V_* and sigma_*. The last segment goes on for ever.

    One that goes on changing normal stress says by which unknowns: the last of them takes from
    imposed normal stress, over sigma_*, as pore pressure does. It states `auxiliary_rates` and
    `auxiliary_steady_states` as a fluid does (see `fluid`), all unknowns being 0 in steady sliding,
    and what they begin with. They are those of its first segment; what that imposes is beside them,
    and is what the last one does. Others are without unknowns.
    """

    #: Whether the last of them is, instead, shear stress by a load point that is ahead of its mean
    #: motion, less what stands as third of its numbers.
    has_load_point_unknown: ClassVar[bool] = False
    received_quantities = frozenset({SLIP_RATE})
    #: Whether the fall of normal stress is pore pressure: beside a fluid that has unknowns, that of
    #: its surroundings.
    of_pressure: ClassVar[bool] = True

    def initial_unknowns(self, scene: SceneView) -> Numbers:
        """Initial values of its unknowns."""
        return ()

    def check(self, scene: SceneView) -> None:
        """Segments that take time; no fluid that changes normal stress too, unless it is its
        pressure that is loaded.
        """
        if len(self.segments) > 1:
            self._check_durations()
        fluid, name = scene.parts.fluid, self.selected_by
        if self.unknowns and fluid.unknowns and not self.of_pressure:
            rule = f"has no meaning for fluid={fluid.name!r}"
            rule += ", whose pore pressure changes normal stress"
            value = getattr(self, name or "name")
            remedy = "Leave one of them out."
            raise InvalidValue(name or "loading", value, rule, remedy=remedy)

    def _check_durations(self) -> None:
        for n, (begins, ends, *_others) in enumerate(self.segment_table):
            if ends - begins < MIN_SEGMENT_DURATION and ends > 0.0:
                least = f"{MIN_SEGMENT_DURATION:g} D_c/V_*"
                rule = f"must be {least} at least, and more than the rounding of time"
                remedy = "Leave out what lasts no time."
                wrong = InvalidValue("duration", self.segments[n].duration, rule, remedy=remedy)
                raise wrong.with_location(f"segment {n + 1}")

    @property
    def has_stress_unknowns(self) -> bool:
        """True if it has unknowns that change normal stress."""
        return bool(self.unknowns) and not self.has_load_point_unknown

    @property
    def segments(self) -> tuple[Segment, ...]:
        """The history; its last segment goes on for ever."""
        raise TypeError(f"{type(self).__name__} loads nothing")

    def describe(self) -> dict[str, Any]:
        """The history as plain data: its segments, as `protocol` takes them."""
        return {"segments": [segment.as_dict() for segment in self.segments]}

    def isolate_segment(self, index: int) -> Loading | Segment:
        """One of its segments without the others; the history itself, if it has one only, or
        unknowns in the first.
        """
        history = self.segments
        if len(history) == 1 or (self.unknowns and index == 0):
            return self
        return history[index]

    @property
    def reported_segment_count(self) -> int:
        """How many segments a motion tells the beginning of; these are the last ones."""
        return len(self.segments) - 1

    @property
    def segment_table(self) -> Any:
        """The segments as motions read them, a row each (see `parameter_layout`)."""
        rows, begins = [], 0.0
        for velocity, _step, lasts, _stress in self.segments:
            log = math.log(abs(velocity)) if velocity else -math.inf
            rows.append((begins, begins + lasts, velocity, log, math.nan, math.nan))
            begins += lasts
        return rows

    @property
    def jump_mask(self) -> Any:
        """Whether each segment begins with a jump, of the load point or of normal stress."""
        before, found = 0.0, []
        for place, segment in enumerate(self.segments):
            ends = place == 1 and bool(self.unknowns)  # which the first segment has
            found.append(ends or segment.displacement != 0.0 or segment.normal_stress != before)
            before = segment.normal_stress
        return found

    @property
    def perturbs_steady_sliding(self) -> bool:
        """True if it changes anything about steady sliding at V_*."""
        return bool(self.unknowns) or any(
            s.load_velocity != 1.0 or s.displacement or s.normal_stress for s in self.segments
        )

    @property
    def changes_normal_stress(self) -> bool:
        """True if it changes normal stress."""
        return self.has_stress_unknowns or any(segment.normal_stress for segment in self.segments)

    @classmethod
    def rejection_error(cls, name: str, value: Any) -> InvalidValue:
        owners = (p for p in BUILT_IN_PARTS.values() if str(name) in p.__dataclass_fields__)
        wanted = " or ".join(p.selected_by for p in owners if p.selected_by not in ("", name))
        remedy = f"Leave it out, or state {wanted} too." if wanted else "Leave it out."
        of = getattr(cls, "name", cls.__name__)  # each protocol has a name of its own
        return InvalidValue(name, value, f"has no meaning for {of}", remedy=remedy)


def load_velocity_field() -> Any:
    """The field of the load point velocity that a history ends with, or is of."""
    return number(
        None,
        "$V_0/V_*$",
        "1",
        "load point velocity after the step",
        "V_*",
        rule=NON_NEGATIVE,
        remedy="0 holds the load point.",
    )


@dataclass(frozen=True, kw_only=True)
class LoadingAtVelocity(Loading):
    """Base of the histories that end with a load point velocity, or are of one: V_* unless
    stated.
    """

    if TYPE_CHECKING:  # each states it, so that fields stay in the order that files know
        load_velocity_ratio: float | None

    @property
    def load_velocity(self) -> float:
        """V_0/V_*, but for what oscillates."""
        return 1.0 if self.load_velocity_ratio is None else self.load_velocity_ratio


BUILT_IN_PARTS = discover_parts(__name__, __path__)
