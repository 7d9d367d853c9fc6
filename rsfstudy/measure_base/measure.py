"""Measures: named results of a scene, with a status, error estimates and cost.

Each measure has its own module and is looked up by its name. Measures that only the studies use are
kept with the studies.

A measure is a frozen dataclass derived from ``Measure`` that implements the physics. Measures are
picklable, so Dask can distribute them. A measure describes itself as plain data, so the description
can be stored in a NetCDF file. Fields that hold a number, a flag or a string may vary along an
axis, in the same way as the fields of a scene. Fields that determine the names of the results may
not vary.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any, ClassVar

import numpy as np

from rsfstudy._deprecation import adopt_former_members, renamed_members
from rsfstudy.error_boundary import CheckedKeywords, guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.measure_base import _declaration_checks
from rsfstudy.measure_base._declaration_checks import OutputValue as OutputValue
from rsfstudy.measure_base._declaration_checks import PlainValue
from rsfstudy.motion import (
    MAX_ERROR_RATIO,
    Accuracy,
    MotionStopped,
    WorkMeter,
    larger_budget_remedy,
)
from rsfstudy.quantities import Output, Quantity, is_variable_name
from rsfstudy.slider import FIELD_NAMES, Scene, cached_attribute
from rsfstudy.status import Status
from rsfstudy.vocabulary import DERIVED_COORDINATES


@guard_methods
@dataclass(frozen=True)
class Outcome:
    """Results of a measure for one scene.

    Attributes
    ----------
    status : Status
    values : mapping of str to float or 1-d array
        Named results. Missing names become NaN in the lattice.
    message : str
        Details about the status.
    rhs_evaluations : int
        Number of right-hand-side evaluations.
    """

    status: Status
    values: Mapping[str, Any] = field(default_factory=dict)
    message: str = ""
    rhs_evaluations: int = 0


#: Names that every lattice uses already.
RESERVED_NAMES = frozenset(
    {"status", "message", "rhs_evaluations", "wall_time", *FIELD_NAMES, *DERIVED_COORDINATES}
)


@renamed_members
@guard_methods
@dataclass(frozen=True)
class Measure(CheckedKeywords):
    """Base class of all measures.

    A measure runs ``compute`` with a work budget, and converts a ``MotionStopped`` into a status.
    To define a measure, write a frozen dataclass with the following members. The fields of the
    dataclass are the options of the measure::

        name: ClassVar[str]                       # name of the measure
        primary_output: str                       # name of the main result
        outputs: Sequence[Output]                 # results, with units and error estimates
        typical_work: int                         # right-hand sides of a cell
        compute(self, scene, accuracy, meter) -> Outcome

    ``compute`` returns ``Outcome(status, values)``. ``values`` contains a number for each name in
    ``outputs``, and a number called ``<name>_error`` for each output with ``error=True``. The
    argument ``accuracy`` contains the requested relative accuracy, ``accuracy.rtol``. The argument
    ``meter`` counts right-hand-side evaluations, and stops a motion that exceeds the work budget.
    To compute a motion, pass both arguments to ``rsfstudy.simulate``: ``rsfstudy.simulate(scene,
    accuracy=accuracy, meter=meter)``. To use the results of another measure, call the
    ``run_nested`` method of that measure. Override ``error_scales`` to report a cell as
    ``unverified`` if its error estimates are far too large::

        error_scales(self, scene, values) -> Mapping[str, float]
    """

    #: File and registry name.
    name: ClassVar[str]
    #: What its inner dimensions and its fields mean, where the vocabulary does not say.
    dimensions: ClassVar[Sequence[Quantity]] = ()
    #: Whether its motions carry time along: what is compiled before any cell is.
    needs_time: ClassVar[tuple[bool, ...]] = (True,)

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        adopt_former_members(cls)

    @property
    def primary_output(self) -> str:
        """Name of the main result of the measure."""
        raise TypeError(f"{type(self).__name__} names no primary_output")

    @property
    def outputs(self) -> Sequence[Output]:
        """Results of the measure."""
        return ()

    @cached_attribute
    def variables(self) -> Mapping[str, tuple[str, ...]]:
        """Names of results and error estimates, with their inner dimensions.

        Scalar results have no inner dimensions.
        """
        return {name: about.dims for about in self.outputs for name in about.variable_names}

    @cached_attribute
    def optional_outputs(self) -> Sequence[str]:
        """Names of results that may be missing from a successful outcome.

        If such a result is missing, the message of the outcome explains why.
        """
        return tuple(about.name for about in self.outputs if about.optional)

    @cached_attribute
    def outputs_with_error(self) -> tuple[str, ...]:
        """Names of the results that have an error estimate."""
        names = self.variables
        return tuple(name for name in names if f"{name}_error" in names)

    @property
    def inner_coordinates(self) -> Mapping[str, np.ndarray]:
        """Coordinate values of the inner dimensions."""
        return {}

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Meanings and units of results, inner dimensions and fields.

        Quantities in the common vocabulary are not included.
        """
        return (*(about for about in self.outputs if about.long_name), *self.dimensions)

    @property
    def solved_fields(self) -> tuple[str, ...]:
        """Fields of the scene that the measure solves for.

        The values of these fields in the scene are ignored.
        """
        return ()

    @property
    def code_classes(self) -> tuple[type[Measure], ...]:
        """Class of this measure, and classes of measures in its fields.

        The code of these classes determines the results.
        """
        held = (getattr(self, f.name) for f in fields(self))
        return (type(self), *(c for m in held if isinstance(m, Measure) for c in m.code_classes))

    @property
    def typical_work(self) -> int:
        """Typical number of right-hand sides per cell at the default accuracy."""
        raise TypeError(f"{type(self).__name__} states no typical work")

    @property
    def work_by_digits(self) -> Mapping[float, float]:
        """Number of right-hand sides by number of digits, relative to the default.

        The study accuracy_cost measured these ratios. The default values apply to a limit cycle,
        the most demanding measure.
        """
        return {2.0: 0.3, 3.0: 0.33, 5.0: 0.55, 7.0: 1.0, 8.0: 1.35, 9.0: 1.97, 10.0: 3.5}

    def expected_work(self, accuracy: Accuracy) -> float:
        """Return the typical number of right-hand sides per cell at an accuracy."""
        return self.typical_work * relative_work(accuracy.rtol, self.work_by_digits)

    @property
    def plain_fields(self) -> dict[str, PlainValue]:
        """Fields that hold a number, a flag or a string, which an axis may vary."""
        values = {f.name: getattr(self, f.name) for f in fields(self) if f.init}
        return {name: value for name, value in values.items() if isinstance(value, PlainValue)}

    def with_(self, **changes: Any) -> Measure:
        """Return a copy with other values of plain fields.

        Raises
        ------
        InvalidValue
            If a name is unknown, if a value has the wrong type, or if the measure rejects a value.
        """
        if not changes:
            return self
        present, annotated = self.plain_fields, {f.name: f.type for f in fields(self)}
        for name, value in changes.items():
            if name not in present:
                rule = f"is no number, flag or text of the measure {self.name}"
                raise InvalidValue("field", name, rule, choices=present)
            whole = type(present[name]) is int and annotated[name] not in (float, "float")
            changes[name] = _declaration_checks.check_field_value(name, value, present[name], whole)
        try:
            return replace(self, **changes)
        except InvalidValue:
            raise
        except Exception as error:
            rule = f"are refused by the measure {self.name} ({type(error).__name__}: {error})"
            raise InvalidValue("fields", changes, rule) from error

    def error_scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Return the scale of the numerical error of each result.

        The requested accuracy is relative to this scale. If the error estimate of a result exceeds
        the requested error more than a hundredfold, the status becomes ``unverified``. Results that
        are not included are not checked, such as statistical results, or results whose resolution
        is an option of the measure.
        """
        return {}

    def compute(self, scene: Scene, accuracy: Accuracy, meter: WorkMeter) -> Outcome:
        """Compute the results for one scene, and count the work in ``meter``."""
        raise TypeError(f"{type(self).__name__} measures nothing")

    def check(self) -> None:
        """Raise ``InvalidValue`` if a lattice cannot hold the declared results."""
        try:
            for name in ("__call__", "run_nested", "run_metered"):
                if getattr(type(self), name) is not getattr(Measure, name):
                    rule = f"has a {name} of its own"
                    remedy = "Write compute: what it gives is checked."
                    raise InvalidValue("measure", self.name, rule, remedy=remedy)
            _check_names(self)
            for name, values in self.inner_coordinates.items():
                _declaration_checks.check_coordinate(name, values)
            _declaration_checks.check_cost(self.typical_work, self.expected_work)
            _declaration_checks.check_description(self.name, self.describe)
        except InvalidValue:
            raise
        except Exception as error:
            rule = f"declares what no lattice can hold ({type(error).__name__}: {error})"
            raise InvalidValue("measure", type(self).__name__, rule) from error

    def __call__(self, scene: Scene, accuracy: Accuracy) -> Outcome:
        """Compute the results for one scene.

        If a motion cannot continue, the reason becomes the status of the outcome.
        """
        outcome, meter = self.run_metered(scene, accuracy)
        if outcome.status is Status.WORK_BUDGET_SPENT and meter.evaluations > meter.budget:
            return replace(outcome, message=outcome.message + larger_budget_remedy(meter.budget))
        return outcome

    def run_nested(self, scene: Scene, accuracy: Accuracy, meter: WorkMeter) -> Outcome:
        """Compute the results for another measure.

        The outcome is the same as that of ``__call__``. The work is added to the meter of the other
        measure.
        """
        outcome, own = self.run_metered(scene, accuracy)
        for regime, spent in own.evaluations_by_regime.items():
            meter.add(regime, spent)
        return outcome

    def run_metered(self, scene: Scene, accuracy: Accuracy) -> tuple[Outcome, WorkMeter]:
        """Compute the results for one scene, and count the right-hand side evaluations."""
        meter = WorkMeter(accuracy.budget, dict(accuracy.methods), accuracy.engine)
        try:
            outcome = self._validate_outcome(self.compute(scene, accuracy, meter))
            if outcome.status.has_values:
                outcome = self._flag_large_errors(accuracy.rtol, scene, outcome)
        except MotionStopped as halt:
            outcome = Outcome(halt.status, message=str(halt))
        spent = _declaration_checks.check_evaluations(meter.evaluations)
        return Outcome(outcome.status, outcome.values, outcome.message, spent), meter

    def _validate_outcome(self, outcome: Outcome) -> Outcome:
        """Check that the results of an outcome agree with their declarations.

        The status becomes ``not_finite`` if a required result of a successful outcome is missing.

        Raises
        ------
        InvalidValue
            If the argument is not an outcome, or if a result is not declared, not real, or has the
            wrong shape.
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
            else _declaration_checks.check_output(declared, inner, name, value)
            for name, value in given
        }
        lacking = self._find_missing_output(values) if outcome.status.has_values else None
        if lacking:
            why = f"{lacking} = {values.get(lacking, math.nan)}"
            return Outcome(Status.NOT_FINITE, values, why)
        return Outcome(outcome.status, values, outcome.message)

    def _find_missing_output(self, values: Mapping[str, OutputValue]) -> str | None:
        """Return the first required result that is missing or not finite.

        Required results are the primary output, and all results with an error estimate, including
        the error. Optional results are required only if they are present.
        """
        known = [
            n for n in self.outputs_with_error if n in values or n not in self.optional_outputs
        ]
        for name in (self.primary_output, *known, *(f"{name}_error" for name in known)):
            value = values.get(name, math.nan)
            finite = math.isfinite(value) if isinstance(value, float) else np.isfinite(value).any()
            if not finite:
                return name
        return None

    def _flag_large_errors(self, rtol: float, scene: Scene, outcome: Outcome) -> Outcome:
        """Change the status to ``unverified`` if an error estimate is too large."""
        values, doubts = outcome.values, []
        for name, scale in self.error_scales(scene, values).items():
            error, asked = values.get(f"{name}_error", 0.0), rtol * scale
            if error > MAX_ERROR_RATIO * asked:
                text = f"{name} = {values[name]:.6g} is known to {error:.2g}, and {asked:.2g}"
                doubts.append(f"{text} was asked for")
        if not doubts:
            return outcome
        message = "; ".join([*filter(None, [outcome.message]), *doubts])
        return Outcome(Status.UNVERIFIED, values, message)

    def describe(self) -> dict[str, Any]:
        """Return a description of the measure as plain data."""
        return {"name": self.name, **asdict(self)}

    @classmethod
    def fields_from_description(cls, described: dict[str, Any], path: str) -> dict[str, Any]:
        """Return the fields that are not plain data from a description.

        The argument ``path`` is the location of the description.
        """
        return {}


def _check_names(measure: Measure) -> None:
    """Raise InvalidValue for numbers, dimensions or quantities that are none, or named twice."""
    stated = [name for about in measure.outputs for name in about.variable_names]
    variables = measure.variables
    names = [*(stated or variables), *measure.inner_coordinates]
    if not variables:
        raise InvalidValue("variables", {}, f"must name a number, in measure {measure.name}")
    if measure.primary_output not in variables:
        raise InvalidValue(
            "primary_output", measure.primary_output, "is not measured", choices=variables
        )
    for name in names:
        if (
            not is_variable_name(name)
            or name in RESERVED_NAMES - {*measure.solved_fields}
            or names.count(name) > 1
        ):
            rule = f"names something else, or nothing, in measure {measure.name}"
            raise InvalidValue("variable", name, rule)
    for name, dims in variables.items():
        if not isinstance(dims, tuple | list) or len(set(dims)) < len(dims):
            raise InvalidValue("dimensions", dims, f"of {name!r} must be names, each once")
        for dim in dims:
            if dim not in measure.inner_coordinates:
                raise InvalidValue("dimension", dim, f"of {name!r} has no coordinate values")
    known = {*names, *measure.plain_fields}
    for about in measure.quantities:
        if not isinstance(about, Quantity) or about.name not in known:
            odd = about.name if isinstance(about, Quantity) else about
            raise InvalidValue("quantities", odd, "describes nothing measured", choices=known)
    for name in measure.solved_fields:
        if name not in FIELD_NAMES:
            raise InvalidValue(
                "solved_fields", name, "is not a field of a scene", choices=FIELD_NAMES
            )


def relative_work(rtol: float, work_by_digits: Mapping[float, float]) -> float:
    """Cost of an accuracy over that of the default one, from measured costs by digits."""
    known = sorted(work_by_digits)
    digits = min(-math.log10(rtol), known[-1] + 2.0)
    above = next((d for d in known[1:] if d >= digits), known[-1])
    below = known[known.index(above) - 1]
    share = (digits - below) / (above - below)
    low, high = work_by_digits[below], work_by_digits[above]
    return float(low * (high / low) ** share)
