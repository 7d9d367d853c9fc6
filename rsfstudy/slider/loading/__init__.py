"""Loading histories, which prescribe the load point motion and the imposed normal stress.

Each module of this package defines one loading history. The function ``discover_parts`` finds the
modules automatically. A loading history is a sequence of segments. Before the first segment, the
slider slides steadily at the reference velocity :math:`V_*`. The base classes are ``Loading`` and
``LoadingWithFinalVelocityBase``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from rsfstudy._deprecation import add_former_member_names
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.slider.parts import NON_NEGATIVE, FloatTuple, Part, discover_parts, number
from rsfstudy.slider.quantities_required_by_parts import SLIP_RATE
from rsfstudy.slider.scene_view import SceneView

#: Minimum duration of a segment in D_c/V_*. The integrator cannot resolve shorter segments. At
#: times greater than D_c/V_*, rounding errors of the time exceed the minimum duration of a segment.
MIN_SEGMENT_DURATION = 1e-16


@make_methods_raise_rsfstudy_errors
class Segment(NamedTuple):
    r"""Segment of a loading history.

    Parameters
    ----------
    load_velocity : float
        Load point velocity :math:`V_0/V_*` during the segment.
    displacement : float, default: 0.0
        Sudden displacement of the load point at the start of the segment, in :math:`D_c`.
    duration : float, default: inf
        Duration of the segment in :math:`D_c/V_*`.
    normal_stress : float, default: 0.0
        Deviation of the imposed normal stress from :math:`\sigma_*` during the segment, divided by
        :math:`\sigma_*`. If the driving stress is inclined to the fault, the deviation is a change
        in :math:`\sigma_3`, and changes in shear stress also change the normal stress.

    Examples
    --------
    >>> from rsfstudy import Segment
    >>> segment = Segment(load_velocity=10.0, duration=2.0)
    >>> segment.as_dict()
    {'velocity': 10.0, 'duration': 2.0}
    """

    load_velocity: float
    displacement: float = 0.0
    duration: float = math.inf
    normal_stress: float = 0.0

    def as_dict(self) -> dict[str, float]:
        r"""Return the segment as a mapping that the function ``protocol`` accepts.

        Returns
        -------
        dict of str to float
            Values for the keys ``velocity``, ``step``, ``duration`` and ``normal_stress``. Values
            that equal the default are omitted. The value of ``normal_stress`` is the imposed normal
            stress in :math:`\sigma_*`.
        """
        stated = {"velocity": self.load_velocity}
        if self.displacement:
            stated["step"] = self.displacement
        if self.duration < math.inf:
            stated["duration"] = self.duration
        if self.normal_stress:
            stated["normal_stress"] = 1.0 + self.normal_stress
        return stated


@add_former_member_names
@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True, kw_only=True)
class Loading(Part):
    r"""Base class of the loading histories.

    To define a loading history, write a frozen dataclass with the class attribute ``name`` and the
    property ``segments``, which returns a tuple of ``Segment``. Declare the fields of the class
    with ``rsfstudy.parts.number``. A segment has the velocity :math:`V_0/V_*`, a sudden
    displacement in :math:`D_c`, a duration in :math:`D_c/V_*` and an imposed normal stress in
    :math:`\sigma_*`. The last segment must have an infinite duration.

    If a loading changes normal stress continuously, the loading adds unknowns to the equations of
    motion. The class of such a loading defines the attributes ``unknowns``, ``auxiliary_rates`` and
    ``auxiliary_steady_states`` in the same way as ``Fluid``, and the method ``initial_unknowns``.
    All unknowns must be zero in steady sliding. The last unknown is the decrease in imposed normal
    stress, divided by :math:`\sigma_*`. Only the first segment of the loading has unknowns.

    Examples
    --------
    Define a hold of the load point, followed by reloading:

    >>> from dataclasses import dataclass
    >>> from rsfstudy import Scene, Segment
    >>> from rsfstudy.parts import Loading, number
    >>> @dataclass(frozen=True, kw_only=True)
    ... class Hold(Loading):
    ...     rest_time: float = number(100.0, "$t_h$", "1", "time of the hold")
    ...     name = "hold"
    ...     @property
    ...     def segments(self):
    ...         return Segment(0.0, duration=self.rest_time), Segment(1.0)
    >>> scene = Scene(loading=Hold, rest_time=50.0)
    >>> scene.parts.loading.segments[0].duration
    50.0
    """

    #: True if the last unknown of the loading determines a shear stress, and False if the last
    #: unknown is a decrease in normal stress. The displacement of the load point relative to its
    #: mean motion causes the shear stress. The shear stress equals the last unknown minus the third
    #: element of ``parameter_values``.
    adds_load_point_displacement_unknown: ClassVar[bool] = False
    received_quantity_names = frozenset({SLIP_RATE})
    #: True if the loading decreases the effective normal stress by an increase in pore pressure. In
    #: a scene whose fluid has unknowns, the loading increases the pore pressure around the fault.
    of_pressure: ClassVar[bool] = True

    def initial_unknowns(self, scene: SceneView) -> FloatTuple:
        """Return the initial values of the unknowns of the loading.

        Parameters
        ----------
        scene : Scene
            Scene that the loading belongs to.

        Returns
        -------
        tuple of float
            One value per unknown. The base class has no unknowns.
        """
        return ()

    def check(self, scene: SceneView) -> None:
        """Check the segment durations, and the compatibility of the loading with the fluid.

        A fluid with unknowns and a loading with unknowns can be combined only if the loading
        changes the pore pressure around the fault.

        Parameters
        ----------
        scene : Scene
            Scene that the loading belongs to.

        Raises
        ------
        InvalidValue
            If a segment is too short, or if the loading and the fluid both change normal stress.
        """
        if len(self.segments) > 1:
            self._check_segment_durations()
        fluid, name = scene.parts.fluid, self.field_name_that_selects_part
        if self.unknowns and fluid.unknowns and not self.of_pressure:
            rule = f"cannot be combined with fluid={fluid.name!r}"
            rule += ", because both change the effective normal stress"
            value = getattr(self, name or "name")
            remedy = f"Omit {name or 'loading'} or fluid."
            raise InvalidValue(name or "loading", value, rule, remedy=remedy)

    def _check_segment_durations(self) -> None:
        """Raise ``InvalidValue`` if a segment is too short."""
        for n, (begins, ends, *_others) in enumerate(self.segment_table):
            if ends - begins < MIN_SEGMENT_DURATION and ends > 0.0:
                least = f"{MIN_SEGMENT_DURATION:g} D_c/V_*"
                rule = (
                    f"must be at least {least}, and large enough to change the time after rounding"
                )
                remedy = "Remove the segment, or increase its duration."
                wrong = InvalidValue("duration", self.segments[n].duration, rule, remedy=remedy)
                raise wrong.with_location(f"segment {n + 1}")

    @property
    def adds_normal_stress_unknowns(self) -> bool:
        """True if the loading has unknowns that change normal stress."""
        return bool(self.unknowns) and not self.adds_load_point_displacement_unknown

    @property
    def segments(self) -> tuple[Segment, ...]:
        """Segments of the loading. The last segment has an infinite duration."""
        raise TypeError(f"{type(self).__name__} does not define segments")

    def describe(self) -> dict[str, Any]:
        """Return the loading history as plain data.

        Returns
        -------
        dict
            List of segments under the key ``"segments"``, in the format that ``protocol`` accepts.
        """
        return {"segments": [segment.as_dict() for segment in self.segments]}

    def isolate_segment(self, segment_index: int) -> Loading | Segment:
        """Return one segment of the loading as a separate loading.

        Parameters
        ----------
        segment_index : int
            Index of the segment.

        Returns
        -------
        Loading or Segment
            Segment with this index. If the loading has only one segment, the method returns the
            loading itself. The loading itself is also returned for index 0 if the loading has
            unknowns.
        """
        history = self.segments
        if len(history) == 1 or (self.unknowns and segment_index == 0):
            return self
        return history[segment_index]

    @property
    def reported_segment_start_count(self) -> int:
        """Number of segment starts that are reported as events of a motion.

        Only the starts of the last segments of the loading are reported.
        """
        return len(self.segments) - 1

    @property
    def segment_table(self) -> Any:
        """Table of the segments, with one row per segment.

        The constants ``SEGMENT_START`` to ``SEGMENT_STRESS_FALL`` of ``rsfstudy.parts`` are the
        column indices of the table.
        """
        rows, begins = [], 0.0
        for velocity, _step, lasts, _stress in self.segments:
            log = math.log(abs(velocity)) if velocity else -math.inf
            rows.append((begins, begins + lasts, velocity, log, math.nan, math.nan))
            begins += lasts
        return rows

    @property
    def jump_at_segment_start_mask(self) -> Any:
        """True for each segment that starts with a jump of the loading.

        A jump of the loading is a sudden change in load point displacement or normal stress. The
        end of a segment with unknowns is also treated as a jump of the loading.
        """
        before, found = 0.0, []
        for place, segment in enumerate(self.segments):
            ends = place == 1 and bool(self.unknowns)  # Only the first segment has unknowns.
            found.append(ends or segment.displacement != 0.0 or segment.normal_stress != before)
            before = segment.normal_stress
        return found

    @property
    def perturbs_steady_sliding(self) -> bool:
        """True if the loading perturbs steady sliding."""
        return bool(self.unknowns) or any(
            s.load_velocity != 1.0 or s.displacement or s.normal_stress for s in self.segments
        )

    @property
    def changes_normal_stress(self) -> bool:
        """True if the loading changes normal stress."""
        return self.adds_normal_stress_unknowns or any(
            segment.normal_stress for segment in self.segments
        )

    @classmethod
    def build_field_rejection_error(cls, field_name: str, value: Any) -> InvalidValue:
        """Return the error for a field that belongs to another loading.

        Parameters
        ----------
        field_name : str
            Name of the field.
        value : object
            Value of the field.

        Returns
        -------
        InvalidValue
            Error whose message names the field that selects the other loading.
        """
        owners = (
            p
            for p in BUILT_IN_LOADING_CLASS_BY_NAME.values()
            if str(field_name) in p.__dataclass_fields__
        )
        wanted = " or ".join(
            p.field_name_that_selects_part
            for p in owners
            if p.field_name_that_selects_part not in ("", field_name)
        )
        remedy = f"Omit {field_name}, or also set {wanted}." if wanted else f"Omit {field_name}."
        # The name of a protocol is an attribute of the instance, not of the class.
        of = getattr(cls, "name", cls.__name__)
        return InvalidValue(field_name, value, f"does not apply to {of!r} loading", remedy=remedy)


def declare_load_velocity_field() -> Any:
    """Declare the field ``load_velocity_ratio`` of a loading.

    Returns
    -------
    dataclasses.Field
        Field for a dataclass, with a default of None.
    """
    return number(
        None,
        "$V_0/V_*$",
        "1",
        "load point velocity after the step",
        "V_*",
        rule=NON_NEGATIVE,
        remedy="Use 0 to hold the load point.",
    )


@dataclass(frozen=True, kw_only=True)
class LoadingWithFinalVelocityBase(Loading):
    """Base class of the loadings that have a field for the load point velocity.

    The load point velocity applies to the whole loading or to its last segment. The default is the
    reference velocity :math:`V_*`.
    """

    # Each subclass declares ``load_velocity_ratio``, because the order of the fields must match
    # existing files.
    if TYPE_CHECKING:
        load_velocity_ratio: float | None

    @property
    def load_velocity(self) -> float:
        """Load point velocity divided by the reference velocity.

        Oscillations of the load point velocity are not included.
        """
        return 1.0 if self.load_velocity_ratio is None else self.load_velocity_ratio


BUILT_IN_LOADING_CLASS_BY_NAME = discover_parts(__name__, __path__)
