"""Measures: from a scene to named numbers with a status, an error estimate and a cost; one file
each, found by name. Those that studies alone use stand beside these.

A measure is a frozen dataclass derived from `Measure` that fills in the physics. It is picklable,
so Dask can send it, and describes itself as plain data, so a NetCDF file can hold it. Its fields
that hold a number, a flag or a text may vary along an axis, as those of the scene do, but for those
that decide which numbers it gives.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any, ClassVar

import numpy as np

from rsfstudy.error_boundary import CheckedKeywords, guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import _checks
from rsfstudy.measures._checks import Plain
from rsfstudy.measures._checks import Value as Value
from rsfstudy.motion.accuracy import MUCH_WORSE, Accuracy, relative_work
from rsfstudy.motion.meter import Halt, Meter, more_work
from rsfstudy.quantity import Output, Quantity
from rsfstudy.slider.derived import derived
from rsfstudy.slider.registry import FIELDS
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status
from rsfstudy.vocabulary import DERIVED


@guard_methods
@dataclass(frozen=True)
class Outcome:
    """Findings of a measure in one scene.

    Attributes
    ----------
    status : Status
    values : mapping of str to float or 1-d array
        The named numbers; names that are missing become NaN in the lattice.
    message : str
        More about the status, in words.
    rhs_evaluations : int
        Right-hand sides spent.
    """

    status: Status
    values: Mapping[str, Any] = field(default_factory=dict)
    message: str = ""
    rhs_evaluations: int = 0


#: Names that every lattice uses already.
TAKEN = frozenset({"status", "message", "rhs_evaluations", "wall_time", *FIELDS, *DERIVED})


@guard_methods
@dataclass(frozen=True)
class Measure(CheckedKeywords):
    """Base of all measures: runs `find` under a work budget and turns a `Halt` into a status.

    What one writes, in a frozen dataclass whose fields are the options of the measure::

        name: ClassVar[str]                       # what it is called
        headline: str                             # the number it is about
        outputs: Sequence[Output]                 # its numbers, with units and error estimates
        typical_work: int                         # right-hand sides of a cell
        find(self, scene, accuracy, meter) -> Outcome

    `find` returns ``Outcome(status, values)``. `values` has a number for each name of `outputs`,
    and one called ``<name>_error`` for each with ``error=True``. `accuracy` holds the requested
    accuracy (``accuracy.rtol``), and `meter` counts right-hand sides and stops a motion that takes
    too many. To follow a motion, pass both on: ``rsfstudy.simulate(scene, accuracy=accuracy,
    meter=meter)``. To use another measure, call its `charged`. Override `scales` to report a cell
    as ``unverified`` if its error estimates are far too large::

        scales(self, scene, values) -> Mapping[str, float]
    """

    #: File and registry name.
    name: ClassVar[str]
    #: What its inner dimensions and its fields mean, where the vocabulary does not say.
    dimensions: ClassVar[Sequence[Quantity]] = ()
    #: Whether its motions carry time along: what is compiled before any cell is.
    clocks: ClassVar[tuple[bool, ...]] = (True,)

    @property
    def headline(self) -> str:
        """The number the measure is about."""
        raise TypeError(f"{type(self).__name__} names no headline")

    @property
    def outputs(self) -> Sequence[Output]:
        """The numbers it gives."""
        return ()

    @derived
    def variables(self) -> Mapping[str, tuple[str, ...]]:
        """Name of each number and of each error estimate, and the inner dimensions it has within
        one cell (none for a plain number).
        """
        return {name: about.dims for about in self.outputs for name in about.names}

    @derived
    def optional(self) -> Sequence[str]:
        """Numbers with an error estimate that an ok outcome may leave out; its message says why."""
        return tuple(about.name for about in self.outputs if about.optional)

    @derived
    def estimated(self) -> tuple[str, ...]:
        """Names of the numbers that have an error estimate."""
        names = self.variables
        return tuple(name for name in names if f"{name}_error" in names)

    @property
    def inner_coordinates(self) -> Mapping[str, np.ndarray]:
        """Coordinate values of the inner dimensions."""
        return {}

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Meaning of its numbers, inner dimensions and fields, with their units: those that the
        vocabulary does not hold.
        """
        return (*(about for about in self.outputs if about.long_name), *self.dimensions)

    @property
    def sought(self) -> tuple[str, ...]:
        """Fields of the scene the measure looks for, whatever value the scene holds."""
        return ()

    @property
    def classes(self) -> tuple[type[Measure], ...]:
        """Its class, and those of measures that it holds: their code decides its numbers."""
        held = (getattr(self, f.name) for f in fields(self))
        return (type(self), *(c for m in held if isinstance(m, Measure) for c in m.classes))

    @property
    def typical_work(self) -> int:
        """Right-hand sides one cell usually takes at the default accuracy."""
        raise TypeError(f"{type(self).__name__} states no typical work")

    @property
    def work_by_digits(self) -> Mapping[float, float]:
        """Right-hand sides by digits asked for, over those at the default accuracy, as the study
        accuracy_cost measured them; here for a limit cycle, the most demanding.
        """
        return {2.0: 0.3, 3.0: 0.33, 5.0: 0.55, 7.0: 1.0, 8.0: 1.35, 9.0: 1.97, 10.0: 3.5}

    def expected_work(self, accuracy: Accuracy) -> float:
        """Right-hand sides one cell usually takes at an accuracy."""
        return self.typical_work * relative_work(accuracy.rtol, self.work_by_digits)

    @property
    def plain_fields(self) -> dict[str, Plain]:
        """Its fields that hold a number, a flag or a text: those an axis may vary."""
        values = {f.name: getattr(self, f.name) for f in fields(self) if f.init}
        return {name: value for name, value in values.items() if isinstance(value, Plain)}

    def with_(self, **changes: Any) -> Measure:
        """A copy with other plain fields, checked anew.

        Raises
        ------
        InvalidValue
            For an unknown name, a value of another type, or one that the measure refuses.
        """
        if not changes:
            return self
        present, annotated = self.plain_fields, {f.name: f.type for f in fields(self)}
        for name, value in changes.items():
            if name not in present:
                rule = f"is no number, flag or text of the measure {self.name}"
                raise InvalidValue("field", name, rule, choices=present)
            whole = type(present[name]) is int and annotated[name] not in (float, "float")
            changes[name] = _checks.alike(name, value, present[name], whole)
        try:
            return replace(self, **changes)
        except InvalidValue:
            raise
        except Exception as error:
            rule = f"are refused by the measure {self.name} ({type(error).__name__}: {error})"
            raise InvalidValue("fields", changes, rule) from error

    def scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """By name of a number with a numerical error, what the accuracy asked for is relative to.

        Where the estimate of one stays more than a hundred times above that, an outcome is not ok,
        but `unverified`. Numbers left out are held to nothing: those that are statistical, or
        resolved by what the measure is told rather than by the accuracy.
        """
        return {}

    def find(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """The physics: measure one scene, charging `meter`."""
        raise TypeError(f"{type(self).__name__} measures nothing")

    def check(self) -> None:
        """Raise InvalidValue where the measure declares what no lattice can hold."""
        try:
            for name in ("__call__", "charged", "metered"):
                if getattr(type(self), name) is not getattr(Measure, name):
                    rule = f"has a {name} of its own"
                    remedy = "Write find: what it gives is checked."
                    raise InvalidValue("measure", self.name, rule, remedy=remedy)
            _checks.check(self, TAKEN)
        except InvalidValue:
            raise
        except Exception as error:
            rule = f"declares what no lattice can hold ({type(error).__name__}: {error})"
            raise InvalidValue("measure", type(self).__name__, rule) from error

    def __call__(self, scene: Scene, accuracy: Accuracy) -> Outcome:
        """Measure one scene; a motion that cannot go on becomes its status."""
        outcome, meter = self.metered(scene, accuracy)
        if outcome.status is Status.WORK_BUDGET_SPENT and meter.spent > meter.budget:
            return replace(outcome, message=outcome.message + more_work(meter.budget))
        return outcome

    def charged(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """The outcome of `__call__`, for a measure that asks this one: its work is added to that of
        the other.
        """
        outcome, own = self.metered(scene, accuracy)
        for regime, spent in own.by_regime.items():
            meter.add(regime, spent)
        return outcome

    def metered(self, scene: Scene, accuracy: Accuracy) -> tuple[Outcome, Meter]:
        """The outcome of `__call__`, and the meter with the work that was spent."""
        meter = Meter(accuracy.budget, dict(accuracy.methods), accuracy.engine)
        try:
            outcome = self._checked(self.find(scene, accuracy, meter))
            if outcome.status.has_values:
                outcome = self._held_to(accuracy.rtol, scene, outcome)
        except Halt as halt:
            outcome = Outcome(halt.status, message=str(halt))
        spent = _checks.count(meter.spent)
        return Outcome(outcome.status, outcome.values, outcome.message, spent), meter

    def _checked(self, outcome: Outcome) -> Outcome:
        """An outcome whose numbers are as declared; ok without one that it must have becomes
        `not_finite`.

        Raises
        ------
        InvalidValue
            For anything but an outcome, and for a number that is not declared, not real, or of
            another shape.
        """
        if not isinstance(outcome, Outcome) or not isinstance(outcome.status, Status):
            raise InvalidValue("measured", outcome, "must be an Outcome with a Status")
        if not isinstance(outcome.values, Mapping):
            raise InvalidValue("measured", outcome.values, "must map names to numbers")
        if not isinstance(outcome.message, str):
            raise InvalidValue("message", type(outcome.message).__name__, "must be a text")
        if outcome.status is Status.PENDING:
            raise InvalidValue("measured", outcome, "must say what became of the cell")
        declared, inner = self.variables, self.inner_coordinates
        given = outcome.values.items()
        values = {
            # most are plain numbers
            name: value
            if isinstance(value, float) and declared.get(name) == ()
            else _checks.number(declared, inner, name, value)
            for name, value in given
        }
        lacking = self._lacking(values) if outcome.status.has_values else None
        if lacking:
            why = f"{lacking} = {values.get(lacking, math.nan)}"
            return Outcome(Status.NOT_FINITE, values, why)
        return Outcome(outcome.status, values, outcome.message)

    def _lacking(self, values: Mapping[str, Value]) -> str | None:
        """The first number of an ok outcome that is missing or not finite: the headline, and each
        that has an error estimate, with that, but for those left out that are optional.
        """
        known = [n for n in self.estimated if n in values or n not in self.optional]
        for name in (self.headline, *known, *(f"{name}_error" for name in known)):
            value = values.get(name, math.nan)
            finite = math.isfinite(value) if isinstance(value, float) else np.isfinite(value).any()
            if not finite:
                return name
        return None

    def _held_to(self, rtol: float, scene: Scene, outcome: Outcome) -> Outcome:
        """An ok outcome, or `unverified` with what is known too badly."""
        values, doubts = outcome.values, []
        for name, scale in self.scales(scene, values).items():
            error, asked = values.get(f"{name}_error", 0.0), rtol * scale
            if error > MUCH_WORSE * asked:
                text = f"{name} = {values[name]:.6g} is known to {error:.2g}, and {asked:.2g}"
                doubts.append(f"{text} was asked for")
        if not doubts:
            return outcome
        message = "; ".join([*filter(None, [outcome.message]), *doubts])
        return Outcome(Status.UNVERIFIED, values, message)

    def describe(self) -> dict[str, Any]:
        """The measure as plain data."""
        return {"name": self.name, **asdict(self)}

    @classmethod
    def restored_fields(cls, described: dict[str, Any], path: str) -> dict[str, Any]:
        """Fields that are no plain data, taken out of a description that stands at `path`."""
        return {}
