"""Base class of measures, and the outcome of a measure.

A measure computes named results of one scene. Each result has a unit, and may have an error
estimate. The class ``Measure`` runs the computation, checks the results, and counts the
right-hand-side evaluations. To define a measure, derive a frozen dataclass from ``Measure``.

Instances of measures are picklable, so Dask can send them to its workers. A measure can also be
converted to plain data, so that a NetCDF file can store its definition. Fields that hold a number,
a flag or a string may vary along an axis, in the same way as the fields of a scene. A field must
not vary along an axis if the names of the results depend on the field.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any, ClassVar

import numpy as np

from rsfstudy._deprecation import add_former_member_names, copy_former_overrides_to_new_names
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import (
    ConstructorKeywordCheckMixin,
    make_methods_raise_rsfstudy_errors,
)
from rsfstudy.measure_base import _declaration_checks
from rsfstudy.measure_base._declaration_checks import OutputValue as OutputValue
from rsfstudy.measure_base._declaration_checks import PlainValue
from rsfstudy.motion import (
    Accuracy,
    Integrator,
    MotionStopped,
    WorkMeter,
    accept_deprecated_accuracy_and_meter,
)
from rsfstudy.quantities import (
    Output,
    Quantity,
    describe_invalid_variable_name,
    is_valid_variable_name,
)
from rsfstudy.slider import Scene, SceneFields, cached_attribute
from rsfstudy.status import Status
from rsfstudy.vocabulary import FORMULAS_OF_DERIVED_COORDINATES


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class Outcome:
    """Results of a measure for one scene.

    Parameters
    ----------
    status : Status
        Status of the computation.
    values : mapping of str to float or ndarray, optional
        Results by name. If a result is missing, its value in the lattice is NaN.
    message : str, default: ""
        Details about the status.
    rhs_evaluations : int, default: 0
        Number of right-hand-side evaluations.

    Examples
    --------
    >>> from rsfstudy.measures import Outcome, Status
    >>> outcome = Outcome(Status.OK, {"critical_stiffness": 0.0145})
    >>> outcome.status.label
    'ok'
    """

    status: Status
    values: Mapping[str, Any] = field(default_factory=dict)
    message: str = ""
    rhs_evaluations: int = 0


#: Names of the variables that every lattice contains. Results must not have these names.
RESERVED_NAMES = frozenset(
    {
        "status",
        "message",
        "rhs_evaluations",
        "wall_time",
        *SceneFields.NAMES,
        *FORMULAS_OF_DERIVED_COORDINATES,
    }
)


@add_former_member_names
@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class Measure(ConstructorKeywordCheckMixin):
    """Base class of all measures.

    To define a measure, write a frozen dataclass with the following members. The fields of the
    dataclass are the options of the measure::

        name: ClassVar[str]                       # name of the measure
        primary_output: str                       # name of the main result
        outputs: Sequence[Output]                 # results, with units and error estimates
        typical_rhs_evaluations: int                         # right-hand-side evaluations per cell
        compute(self, scene, integrator) -> Outcome

    The method ``compute`` returns ``Outcome(status, values)``. The mapping ``values`` contains one
    number for each name in ``outputs``. For each output with ``error=True``, the mapping also
    contains an error estimate with the name ``<name>_error``.

    The argument ``integrator`` is an ``rsfstudy.Integrator``. The integrator stores the requested
    relative accuracy as ``integrator.rtol``, counts right-hand-side evaluations, and stops a motion
    that exceeds the work budget. To compute a motion, pass the integrator to ``rsfstudy.simulate``:
    ``rsfstudy.simulate(scene, integrator=integrator)``. The functions ``rsfstudy.critical_step``
    and ``rsfstudy.limit_cycle`` also accept the argument ``integrator``. To use the outcome of
    another measure, call the ``run_nested`` method of that measure. To estimate errors, repeat the
    computation with ``integrator.refined()``, whose tolerances are ten times smaller.

    Override ``error_scales`` to set the status to ``unverified`` if the error estimates are far too
    large::

        error_scales(self, scene, values) -> Mapping[str, float]

    If a motion cannot continue, ``compute`` may raise ``MotionStopped``. The base class converts
    the exception into a status.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> from rsfstudy import Accuracy, Scene
    >>> from rsfstudy.measures import Measure, Outcome, Output, Status
    >>> @dataclass(frozen=True)
    ... class RateWeakening(Measure):
    ...     name = "rate_weakening"
    ...     primary_output = "b_minus_a"
    ...     outputs = (Output("b_minus_a", "$b-a$", "1", "rate weakening"),)
    ...     typical_rhs_evaluations = 1
    ...
    ...     def compute(self, scene, integrator):
    ...         return Outcome(Status.OK, {"b_minus_a": scene.b - scene.a})
    >>> outcome = RateWeakening()(Scene(a=0.01, b_over_a=1.5), Accuracy())
    >>> round(outcome.values["b_minus_a"], 6)
    0.005
    """

    #: Name of the measure in files and in the registry.
    name: ClassVar[str]
    #: Meanings of inner dimensions and fields that are not in the common vocabulary.
    dimensions: ClassVar[Sequence[Quantity]] = ()
    #: Variants of the equations of motion that are compiled before the first cell is computed. True
    #: stands for the equations in which time is an unknown, and False for the equations without
    #: time. The tuple is empty if the measure does not integrate motions.
    needs_time: ClassVar[tuple[bool, ...]] = (True,)
    #: Fields that descriptions and cell keys contain only if the value is not the default. Declare
    #: a field here if an existing measure gets a new field, so that files remain identical.
    fields_stored_unless_default: ClassVar[tuple[str, ...]] = ()

    def __init_subclass__(cls) -> None:
        """Add the new names of members that the subclass defines under former names."""
        super().__init_subclass__()
        copy_former_overrides_to_new_names(cls)
        accept_deprecated_accuracy_and_meter(cls)

    @property
    def primary_output(self) -> str:
        """Name of the main result of the measure."""
        raise TypeError(f"{type(self).__name__} does not define primary_output")

    @property
    def outputs(self) -> Sequence[Output]:
        """Results of the measure, with their units and error estimates."""
        return ()

    @cached_attribute
    def variables(self) -> Mapping[str, tuple[str, ...]]:
        """Inner dimensions, keyed by the name of the result or error estimate.

        For a scalar result, the tuple of dimensions is empty.
        """
        return {name: about.dims for about in self.outputs for name in about.variable_names}

    @cached_attribute
    def optional_output_names(self) -> Sequence[str]:
        """Names of the results that may be missing from a successful outcome.

        If an optional result is missing, the message of the outcome contains the reason.
        """
        return tuple(about.name for about in self.outputs if about.optional)

    @cached_attribute
    def names_of_outputs_with_error(self) -> tuple[str, ...]:
        """Names of the results that have an error estimate."""
        names = self.variables
        return tuple(name for name in names if f"{name}_error" in names)

    @property
    def output_coordinates(self) -> Mapping[str, np.ndarray]:
        """Mapping from inner dimensions to their coordinate values."""
        return {}

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Meanings and units of results, inner dimensions and fields.

        Quantities of the common vocabulary are not included.
        """
        return (*(about for about in self.outputs if about.long_name), *self.dimensions)

    @property
    def solved_fields(self) -> tuple[str, ...]:
        """Scene fields that the measure solves for.

        The measure ignores the values of these fields in the scene.
        """
        return ()

    @property
    def result_determining_classes(self) -> tuple[type[Measure], ...]:
        """Classes whose code determines the results of the measure.

        The tuple contains the class of this measure and the classes of all measures in its fields.
        """
        held = (getattr(self, f.name) for f in fields(self))
        return (
            type(self),
            *(c for m in held if isinstance(m, Measure) for c in m.result_determining_classes),
        )

    @property
    def typical_rhs_evaluations(self) -> int:
        """Typical number of right-hand-side evaluations per cell.

        The number applies to the default accuracy.
        """
        raise TypeError(f"{type(self).__name__} does not define typical_rhs_evaluations")

    @property
    def relative_cost_by_digits(self) -> Mapping[float, float]:
        """Mapping from the requested number of digits to the relative computational cost.

        The number of digits is ``-log10(rtol)``, and the cost is relative to the cost at the
        default accuracy. The default values were measured for limit cycles, the most demanding
        measure, in the study ``accuracy_cost``.
        """
        return {2.0: 0.3, 3.0: 0.33, 5.0: 0.55, 7.0: 1.0, 8.0: 1.35, 9.0: 1.97, 10.0: 3.5}

    def expected_work(self, accuracy: Accuracy) -> float:
        """Return the expected number of right-hand-side evaluations per cell.

        Parameters
        ----------
        accuracy : Accuracy
            Accuracy of the computation.

        Returns
        -------
        float
            The typical number of evaluations, scaled to the accuracy.
        """
        return self.typical_rhs_evaluations * compute_relative_cost_at_accuracy(
            accuracy, self.relative_cost_by_digits
        )

    @property
    def scalar_field_values(self) -> dict[str, PlainValue]:
        """Mapping from names to values of the fields that contain a number, flag or string.

        Only these fields may vary along an axis.
        """
        values = {f.name: getattr(self, f.name) for f in fields(self) if f.init}
        return {name: value for name, value in values.items() if isinstance(value, PlainValue)}

    @property
    def fields_omitted_from_storage(self) -> frozenset[str]:
        """Names of the fields that are omitted from descriptions and cell keys."""
        defaults = {
            name: type(self).__dataclass_fields__[name].default
            for name in self.fields_stored_unless_default
        }
        return frozenset(n for n, default in defaults.items() if getattr(self, n) == default)

    def with_(self, **changes: Any) -> Measure:
        """Return a copy of the measure with new values of number, flag or string fields.

        Parameters
        ----------
        **changes : int, float, str or bool
            New values of fields, by name.

        Returns
        -------
        Measure
            The copy, or the measure itself if there are no changes.

        Raises
        ------
        InvalidValue
            If a name is unknown, if a value has the wrong type, or if the measure rejects a value.
        """
        if not changes:
            return self
        present, annotated = self.scalar_field_values, {f.name: f.type for f in fields(self)}
        for name, value in changes.items():
            if name not in present:
                rule = f"is not a number, flag or string field of the measure {self.name}"
                raise InvalidValue("field", name, rule, choices=present)
            whole = type(present[name]) is int and annotated[name] not in (float, "float")
            changes[name] = _declaration_checks.check_field_value(name, value, present[name], whole)
        try:
            return replace(self, **changes)
        except InvalidValue:
            raise
        except Exception as error:
            rule = (
                f"are invalid fields of the measure {self.name} ({type(error).__name__}: {error})"
            )
            raise InvalidValue("fields", changes, rule) from error

    def error_scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Return a mapping from results to the scales of their numerical errors.

        The requested error of each result is the relative accuracy multiplied by the scale of the
        result. If the error estimate of a result is more than a hundred times the requested error,
        the status of the cell becomes ``unverified``. Results without a scale are not checked. A
        method that overrides this method should omit statistical results, and results whose
        resolution is set by an option of the measure.

        Parameters
        ----------
        scene : Scene
            Scene of the computation.
        values : mapping of str to float or ndarray
            Results by name.

        Returns
        -------
        mapping of str to float
            Scales by name of the result. The base class returns an empty mapping.
        """
        return {}

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the results for one scene.

        Parameters
        ----------
        scene : Scene
            Scene to evaluate.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Status, results and message.

        Raises
        ------
        MotionStopped
            If the motion cannot continue. The caller converts the exception into a status.
        """
        raise TypeError(f"{type(self).__name__} does not define compute")

    def check(self) -> None:
        """Check the declarations of the measure.

        Raises
        ------
        InvalidValue
            If a lattice or a file could not store the declared results.
        """
        try:
            for name in ("__call__", "run_nested", "run_metered"):
                if getattr(type(self), name) is not getattr(Measure, name):
                    rule = f"overrides {name}()"
                    remedy = (
                        "Override compute() instead, because the base class checks the result "
                        "of compute()."
                    )
                    raise InvalidValue(f"measure {self.name!r}", ..., rule, remedy=remedy)
            _check_names_declared_by_measure(self)
            for name, values in self.output_coordinates.items():
                _declaration_checks.check_coordinate_values(name, values)
            _declaration_checks.check_declared_cost_estimates(
                self.typical_rhs_evaluations, self.expected_work
            )
            _declaration_checks.check_measure_description(self.name, self.describe)
        except InvalidValue:
            raise
        except Exception as error:
            raise InvalidValue(
                f"declaration of measure {type(self).__name__!r}",
                ...,
                f"is invalid and cannot be stored ({type(error).__name__}: {error})",
                remedy="Check the outputs of the measure.",
            ) from error

    def __call__(self, scene: Scene, accuracy: Accuracy) -> Outcome:
        """Compute the results for one scene.

        If a motion cannot continue, the status of the outcome shows the reason.

        Parameters
        ----------
        scene : Scene
            Scene to evaluate.
        accuracy : Accuracy
            Requested accuracy and work budget.

        Returns
        -------
        Outcome
            Status, results, message and number of right-hand-side evaluations.
        """
        outcome, meter = self.run_metered(scene, accuracy)
        if outcome.status is Status.WORK_BUDGET_SPENT and meter.evaluations > meter.budget:
            return replace(outcome, message=outcome.message + meter.larger_budget_advice)
        return outcome

    @accept_deprecated_accuracy_and_meter
    def run_nested(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the results for use in another measure.

        The right-hand-side evaluations are added to the count of the other measure.

        Parameters
        ----------
        scene : Scene
            Scene to evaluate.
        integrator : Integrator
            Integrator of the other measure.

        Returns
        -------
        Outcome
            Outcome as returned by ``__call__``, except that the message does not suggest a larger
            budget.
        """
        outcome, own = self.run_metered(scene, integrator.accuracy)
        for regime, spent in own.evaluations_by_regime.items():
            integrator.work_meter.add_evaluations(regime, spent)
        return outcome

    def run_metered(self, scene: Scene, accuracy: Accuracy) -> tuple[Outcome, WorkMeter]:
        """Compute the results for one scene, and return the outcome and the work meter.

        Parameters
        ----------
        scene : Scene
            Scene to evaluate.
        accuracy : Accuracy
            Requested accuracy and work budget.

        Returns
        -------
        outcome : Outcome
            Outcome after all checks.
        meter : WorkMeter
            Right-hand-side evaluations by regime.
        """
        integrator = Integrator(accuracy)
        try:
            outcome = self._validate_outcome(self.compute(scene, integrator))
            if outcome.status.has_values:
                outcome = self._mark_unverified_if_errors_are_large(integrator, scene, outcome)
        except MotionStopped as halt:
            outcome = Outcome(halt.status, message=str(halt))
        spent = _declaration_checks.check_evaluation_count(integrator.evaluations)
        outcome = Outcome(outcome.status, outcome.values, outcome.message, spent)
        return outcome, integrator.work_meter

    def _validate_outcome(self, outcome: Outcome) -> Outcome:
        """Check that the results of an outcome match their declarations.

        If a required result of a successful outcome is missing, the status becomes ``not_finite``.

        Raises
        ------
        InvalidValue
            If the argument is not an outcome, or if a result is undeclared, is not a real number,
            or has the wrong shape.
        """
        if not isinstance(outcome, Outcome) or not isinstance(outcome.status, Status):
            raise InvalidValue("measured", outcome, "must be an Outcome with a Status")
        if not isinstance(outcome.values, Mapping):
            raise InvalidValue("measured", outcome.values, "must map names to numbers")
        if not isinstance(outcome.message, str):
            raise InvalidValue("message", type(outcome.message).__name__, "must be a string")
        if outcome.status is Status.PENDING:
            raise InvalidValue(
                "measured",
                outcome,
                "has the status pending, but must have the status of a computed cell",
            )
        declared, inner = self.variables, self.output_coordinates
        given = outcome.values.items()
        values = {
            # The full check is slow and is not necessary for plain floats, the most common results.
            name: value
            if isinstance(value, float) and declared.get(name) == ()
            else _declaration_checks.check_output_value(declared, inner, name, value)
            for name, value in given
        }
        lacking = self._find_missing_output(values) if outcome.status.has_values else None
        if lacking:
            why = f"{lacking} = {values.get(lacking, math.nan)}"
            return Outcome(Status.NOT_FINITE, values, why)
        return Outcome(outcome.status, values, outcome.message)

    def _find_missing_output(self, output_values: Mapping[str, OutputValue]) -> str | None:
        """Return the name of the first required result that is not finite.

        The primary output is required. Each result with an error estimate is also required,
        together with the error estimate. Optional results are required only if they are present.
        """
        known = [
            n
            for n in self.names_of_outputs_with_error
            if n in output_values or n not in self.optional_output_names
        ]
        for name in (self.primary_output, *known, *(f"{name}_error" for name in known)):
            value = output_values.get(name, math.nan)
            finite = math.isfinite(value) if isinstance(value, float) else np.isfinite(value).any()
            if not finite:
                return name
        return None

    def _mark_unverified_if_errors_are_large(
        self, integrator: Integrator, scene: Scene, outcome: Outcome
    ) -> Outcome:
        """Set the status to ``unverified`` if an error is too large."""
        values, doubts = outcome.values, []
        for name, scale in self.error_scales(scene, values).items():
            error, asked = values.get(f"{name}_error", 0.0), integrator.result_tolerance() * scale
            if error > Accuracy.MAX_RELIABLE_ERROR_OVER_RTOL * asked:
                text = (
                    f"{name} = {values[name]:.6g} has an error estimate of {error:.2g}, but "
                    f"{asked:.2g}"
                )
                doubts.append(f"{text} was requested")
        if not doubts:
            return outcome
        message = "; ".join([*filter(None, [outcome.message]), *doubts])
        return Outcome(Status.UNVERIFIED, values, message)

    def describe(self) -> dict[str, Any]:
        """Return the definition of the measure as plain data.

        Returns
        -------
        dict
            Name of the measure, and values of its fields.
        """
        omitted = self.fields_omitted_from_storage
        return {"name": self.name, **{n: v for n, v in asdict(self).items() if n not in omitted}}

    @classmethod
    def fields_from_description(cls, described: dict[str, Any], path: str) -> dict[str, Any]:
        """Return values of fields that a description omits or does not store as plain data.

        Parameters
        ----------
        described : dict
            Description of a measure, as returned by ``describe``.
        path : str
            Location of the description in the file, for use in error messages.

        Returns
        -------
        dict
            Field values by name. The base class returns the default values of omitted fields.
        """
        omitted = [name for name in cls.fields_stored_unless_default if name not in described]
        return {name: cls.__dataclass_fields__[name].default for name in omitted}


def _check_names_declared_by_measure(measure: Measure) -> None:
    """Check the names of results, dimensions, quantities and solved fields.

    Raises
    ------
    InvalidValue
        If a name is invalid, unknown or duplicated.
    """
    stated = [name for about in measure.outputs for name in about.variable_names]
    variables = measure.variables
    names = [*(stated or variables), *measure.output_coordinates]
    if not variables:
        raise InvalidValue(
            "variables", {}, "must contain at least one numeric output"
        ).with_location(f"measure {measure.name!r}")
    if measure.primary_output not in variables:
        raise InvalidValue(
            "primary_output",
            measure.primary_output,
            "is not an output of the measure",
            choices=variables,
        )
    for name in names:
        kind, rule, remedy = "variable name", "", "Rename the variable."
        if not is_valid_variable_name(name):
            rule, remedy = describe_invalid_variable_name(name)
        elif name in RESERVED_NAMES - {*measure.solved_fields}:
            rule = "is reserved"
        elif names.count(name) > 1:
            kind, rule = "variable", "is declared more than once"
            remedy = "Remove or rename one of the declarations."
        if rule:
            raise InvalidValue(kind, name, rule, remedy=remedy).with_location(
                f"measure {measure.name!r}"
            )
    for name, dims in variables.items():
        if not isinstance(dims, tuple | list) or len(set(dims)) < len(dims):
            remedy = "For a single dimension x, write ('x',)."
            raise InvalidValue(
                "dimensions", dims, "must be a tuple of unique names", remedy=remedy
            ).with_location(f"output {name!r}")
        for dim in dims:
            if dim not in measure.output_coordinates:
                raise InvalidValue(
                    "dimension",
                    dim,
                    f"of the output {name!r} has no coordinate values",
                )
    known = {*names, *measure.scalar_field_values}
    for about in measure.quantities:
        if not isinstance(about, Quantity) or about.name not in known:
            odd = about.name if isinstance(about, Quantity) else about
            raise InvalidValue(
                "quantities", odd, "must describe outputs of the measure", choices=known
            )
    for name in measure.solved_fields:
        if name not in SceneFields.NAMES:
            raise InvalidValue(
                "solved_fields", name, "must contain only scene fields", choices=SceneFields.NAMES
            )


def compute_relative_cost_at_accuracy(
    accuracy: Accuracy, relative_cost_by_digits: Mapping[float, float]
) -> float:
    """Return the relative cost of the computation at a requested accuracy.

    The function interpolates costs that were measured for several numbers of digits.

    Parameters
    ----------
    accuracy : Accuracy
        Accuracy of the cells.
    relative_cost_by_digits : mapping of float to float
        Relative cost by number of digits ``-log10(rtol)``.

    Returns
    -------
    float
        Cost at ``accuracy`` divided by the cost at the default accuracy.
    """
    known = sorted(relative_cost_by_digits)
    digits = min(accuracy.digits, known[-1] + 2.0)
    above = next((d for d in known[1:] if d >= digits), known[-1])
    below = known[known.index(above) - 1]
    share = (digits - below) / (above - below)
    low, high = relative_cost_by_digits[below], relative_cost_by_digits[above]
    return float(low * (high / low) ** share)
