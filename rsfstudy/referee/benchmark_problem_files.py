"""Benchmark problems and their files.

A ``BenchmarkProblem`` defines a spring-slider, its initial state, its loading, and the quantities
that a code must report. The function ``read_problem`` reads a problem file, and
``write_shipped_problems`` writes the shipped problems for use with other codes.
"""

from __future__ import annotations

import csv
import math
import re
import shutil
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from operator import add
from pathlib import Path
from typing import Any, get_type_hints

import msgspec
import numpy as np
from scipy.special import lambertw

from rsfstudy.errors import DataError, InvalidValue, shorten_text
from rsfstudy.exception_conversion import check_regular_file, format_exception
from rsfstudy.motion import Event, EventKind, Integrator, MotionStopped
from rsfstudy.parts import Segment
from rsfstudy.path_checks import check_path_is_valid
from rsfstudy.rig import Rig, convert_to_si
from rsfstudy.slider import Scene, SceneFields

#: Folder of the shipped problems and their answers.
SHIPPED_PROBLEM_FOLDER = Path(__file__).with_name("problems")
#: SI units of the quantities that a problem can request, for each type of answer.
SI_UNITS_BY_SERIES_QUANTITY = {
    "time": "s", "friction": "1", "slip_rate": "m/s", "theta": "s", "theta_1": "s", "theta_2": "s",
    "slip": "m", "normal_stress": "Pa", "pore_pressure": "Pa",
}  # fmt: skip
SI_UNITS_BY_PEAK_QUANTITY = {"event": "1", "time": "s", "slip_rate": "m/s"}
SI_UNITS_BY_SCALAR_QUANTITY = {
    "critical_stiffness": "Pa/m", "growth_rate": "1/s", "angular_frequency": "1/s",
    "critical_velocity": "m/s", "critical_displacement": "m", "recurrence_interval": "s",
    "static_stress_drop": "Pa", "dynamic_stress_drop": "Pa", "peak_slip_rate": "m/s",
    "slowest_slip_rate": "m/s",
}  # fmt: skip
SI_UNITS_BY_ANSWER_TYPE_AND_QUANTITY = {
    "series": SI_UNITS_BY_SERIES_QUANTITY,
    "peaks": SI_UNITS_BY_PEAK_QUANTITY,
    "numbers": SI_UNITS_BY_SCALAR_QUANTITY,
}
#: Rig fields, keyed by the names of problem parameters. The first dictionary contains only the
#: required parameters.
_REQUIRED_RIG_FIELD_BY_PARAMETER = {
    "normal_stress": "normal_stress",
    "D_c": "slip_distance",
    "V_star": "reference_velocity",
}
_RIG_FIELD_BY_PARAMETER = {
    **_REQUIRED_RIG_FIELD_BY_PARAMETER,
    "stiffness": "stiffness",
    "period": "period",
    "mass": "mass",
}
#: SI units of the parameters that are converted to dimensionless fields of the scene.
_SI_UNITS_BY_PARAMETER = {
    "b": "1", "b_2": "1", "D_c_2": "m", "radiation_damping": "Pa s/m", "V_c": "m/s",
    "V_unstable": "m/s",
}  # fmt: skip
#: Friction laws with the state variable b ln(theta/theta_*). For these laws, theta can be computed
#: from the state variable.
_NAMES_OF_LAWS_WITH_THETA_AS_STATE = (
    "slip", "slowness", "family", "perrin_rice_zheng", "composite", "two_slip_states",
    "two_slowness_states",
)  # fmt: skip


#: The pattern matches error messages of msgspec about wrong types. The dictionary contains
#: descriptions of types for error messages of rsfstudy.
_MSGSPEC_TYPE_ERROR_PATTERN = re.compile(r"Expected `(\w+)`, got `(\w+)`(?: - at `\$(.*)`)?")
_READABLE_NAME_BY_TYPE_NAME = {
    "array": "a list", "object": "a table", "str": "a string", "int": "a whole number",
    "float": "a number", "bool": "true or false", "null": "nothing", "date": "a date",
}  # fmt: skip
#: Maximum number of digits of an answer, and maximum number of requested peaks.
_MAX_DIGITS, _MAX_PEAKS = 15, 10_000


@dataclass(frozen=True, kw_only=True)
class BenchmarkProblem:
    """Benchmark problem for codes that simulate a spring-slider.

    Parameters
    ----------
    title : str
        Title of the problem.
    law : str
        Name of the state evolution law.
    equations : str, optional
        Description of the equations for readers of the problem.
    conventions : str, optional
        Description of conventions that differ between codes, for readers of the problem.
    report : {"series", "peaks", "numbers"}, optional
        Type of the answer: a series of values at the times ``times``, the times and values of slip
        rate maxima, or single numbers. The default is a series.
    quantities : list of str
        Names of the requested quantities, which are columns of the answer.
    parameters : mapping of str to object
        Values of the parameters, as numbers in SI units or as strings with units. The parameters
        ``a``, ``b``, ``D_c``, ``V_star`` and ``normal_stress`` are required. A law with two state
        variables also needs ``b_2`` and ``D_c_2``. Optional parameters are ``mu_star``,
        ``stiffness``, ``period``, ``mass``, ``radiation_damping``, ``V_c``, ``V_unstable``, and
        other fields of a scene.
    initial : mapping of str to object, optional
        Initial values ``slip_rate`` and ``theta``. For a law with two state variables, ``theta`` is
        a list. By default, the motion starts from steady sliding at ``V_star``.
    loading : list of mapping, optional
        Segments of the loading history, as for ``Rig.protocol``.
    times : list of float, optional
        Times of a series in s, in increasing order.
    count : int, default: 0
        Number of slip rate maxima to report.
    digits : int, default: 12
        Number of significant digits of the known answer, from 1 to 15.
    number : int, default: 0
        Number of a shipped problem, or 0 for a user-defined problem.

    Raises
    ------
    InvalidValue
        If a field has an invalid value, or if a required parameter is missing.
    """

    title: str
    law: str
    equations: str = ""
    conventions: str = ""
    report: str = "series"
    quantities: list[str]
    parameters: Mapping[str, Any]
    initial: Mapping[str, Any] = field(default_factory=dict)
    loading: list[Mapping[str, Any]] = field(default_factory=list)
    times: list[float] = field(default_factory=list)
    count: int = 0
    digits: int = 12
    number: int = 0

    def __post_init__(self) -> None:
        """Validate the fields of the problem."""
        if self.report not in SI_UNITS_BY_ANSWER_TYPE_AND_QUANTITY:
            raise InvalidValue(
                "report", self.report, "is unknown", choices=SI_UNITS_BY_ANSWER_TYPE_AND_QUANTITY
            )
        if not self.quantities:
            rule = "must list at least one quantity"
            raise InvalidValue(
                "quantities", self.quantities, rule, choices=self.si_units_by_quantity
            )
        if not 1 <= self.digits <= _MAX_DIGITS:
            raise InvalidValue("digits", self.digits, f"must lie between 1 and {_MAX_DIGITS}")
        for name in self.quantities:
            if name not in self.si_units_by_quantity:
                raise InvalidValue(
                    "quantities", name, "is unknown", choices=self.si_units_by_quantity
                )
        times = np.array(self.times, dtype=float)
        if self.report == "series" and not (len(times) and np.isfinite(times).all()):
            raise InvalidValue("times", self.times, "must list the times of a series, in s")
        if (np.diff(times, prepend=-1e-300) <= 0.0).any():
            raise InvalidValue("times", self.times, "must increase, from 0 or later")
        if self.report == "peaks" and not 1 <= self.count <= _MAX_PEAKS:
            rule = (
                f"must lie between 1 and {_MAX_PEAKS:,}, because it is the number of peaks to "
                "report"
            )
            raise InvalidValue("count", self.count, rule)
        if self.law not in _NAMES_OF_LAWS_WITH_THETA_AS_STATE:
            raise InvalidValue(
                "law", self.law, "is unknown", choices=_NAMES_OF_LAWS_WITH_THETA_AS_STATE
            )
        two = ("b_2", "D_c_2") if self.law.startswith("two") else ()
        for name in ("a", "b", *two, *_REQUIRED_RIG_FIELD_BY_PARAMETER):
            if name not in self.parameters:
                raise InvalidValue("parameters", [*self.parameters], f"must contain {name}")
        if self.initial and self.initial.keys() != {"slip_rate", "theta"}:
            rule = "must contain slip_rate and theta, or be empty"
            raise InvalidValue("initial", [*self.initial], rule)
        if self.initial and "phi" in self.parameters:
            rule = (
                "cannot be combined with phi, because the motion starts from steady sliding at "
                "normal_stress"
            )
            raise InvalidValue("initial", [*self.initial], rule)

    @property
    def si_units_by_quantity(self) -> Mapping[str, str]:
        """SI units of the quantities that can be requested, by name."""
        return SI_UNITS_BY_ANSWER_TYPE_AND_QUANTITY[self.report]

    @property
    def answer_index_column_name(self) -> str:
        """Name of the column that identifies the rows of the answer.

        The name is empty if the answer consists of a single row.
        """
        return {"series": "time", "peaks": "event", "numbers": ""}[self.report]

    @property
    def answer_column_names(self) -> tuple[str, ...]:
        """Names of the columns of the answer."""
        return (
            (self.answer_index_column_name, *self.quantities)
            if self.answer_index_column_name
            else tuple(self.quantities)
        )

    @property
    def answer_index_values(self) -> np.ndarray:
        """Values of the index column: times in s, or peak numbers.

        If there is no index column, the only value is 1.
        """
        rows = self.times if self.report == "series" else range(1, max(self.count, 1) + 1)
        return np.array(rows, dtype=float)

    @property
    def answer_column_headings(self) -> list[str]:
        """Column headings of the answer table, with units."""
        return [f"{name} ({self.si_units_by_quantity[name]})" for name in self.answer_column_names]

    @cached_property
    def rig(self) -> Rig:
        """Rig that has the scales, the stiffness and the inertia that the problem specifies."""
        return Rig(
            **{
                _RIG_FIELD_BY_PARAMETER[n]: v
                for n, v in self.parameters.items()
                if n in _RIG_FIELD_BY_PARAMETER
            }
        )

    @cached_property
    def si_parameters(self) -> Mapping[str, float]:
        """SI values of the parameters that become dimensionless scene fields."""
        stated = self.parameters
        return {
            n: convert_to_si(n, stated[n], units)
            for n, units in _SI_UNITS_BY_PARAMETER.items()
            if n in stated
        }

    @property
    def b_values(self) -> tuple[float, ...]:
        """Evolution effect parameters b, with one value per state variable."""
        return tuple(
            self.si_parameters[name] for name in ("b", "b_2") if name in self.si_parameters
        )

    @property
    def radiation_damping(self) -> float:
        r"""Radiation damping :math:`\eta` in Pa s/m.

        The value is zero if the problem has no radiation damping.
        """
        return self.si_parameters.get("radiation_damping", 0.0)

    @cached_property
    def scene(self) -> Scene:
        """Scene that represents the problem, except for the initial state."""
        rig, si, a = (
            self.rig,
            self.si_parameters,
            _parse_positive_si_value("a", self.parameters["a"], "1"),
        )
        fields = {
            n: v
            for n, v in self.parameters.items()
            if n not in {*_RIG_FIELD_BY_PARAMETER, *_SI_UNITS_BY_PARAMETER}
        }
        fields |= {"law": self.law, "a": a}
        if len(self.b_values) == 1:
            fields["b_over_a"] = self.b_values[0] / a
        else:
            fields |= {f"b{i}_over_a": b / a for i, b in enumerate(self.b_values, start=1)}
            fields["length_ratio"] = si["D_c_2"] / rig.slip_distance
        if "phi" in fields:
            fields["normal_stress"] = "variable"
        if self.radiation_damping:
            fields["radiation_damping"] = self.radiation_damping * rig.reference_velocity
        if "V_c" in si:
            fields["cutoff_velocity_ratio"] = si["V_c"] / rig.reference_velocity
        if "V_unstable" in si:
            period = rig.period or SceneFields.map_field_names_to_defaults()["period"]
            norm = si["V_unstable"] * period / (2.0 * math.pi * rig.slip_distance)
            fields["instability_norm"] = norm
        if self.loading:
            fields["loading"] = rig.protocol(self.loading)
        return rig.scene(**fields)

    @property
    def steady_thetas_at_reference_velocity(self) -> tuple[float, ...]:
        r"""Steady-state values of theta at the reference velocity.

        The tuple contains one value of :math:`\theta_*` in s per state variable.

        Notes
        -----
        For most laws, :math:`\theta_* = D_c/V_*`. For the law of Perrin, Rice and Zheng [1]_,
        :math:`\theta_* = 2 D_c/V_*`. For the composite law of Kato and Tullis [2]_,

        .. math::

            \theta_* = \frac{D_c}{V_*} e^u, \quad u e^u = e^{-V_*/V_c}.

        The solution :math:`u` is the Lambert W function of :math:`e^{-V_*/V_c}`.

        References
        ----------
        .. [1] Perrin, Rice and Zheng (1995), J. Mech. Phys. Solids 43, 1461-1495.

        .. [2] Kato and Tullis (2001), Geophys. Res. Lett. 28, 1103-1106.
        """
        velocity = self.rig.reference_velocity
        scale = 2.0 if self.law == "perrin_rice_zheng" else 1.0
        if self.law == "composite":
            scale = math.exp(lambertw(math.exp(-velocity / self.si_parameters["V_c"])).real)
        lengths = self.rig.slip_distance, self.si_parameters.get("D_c_2", math.nan)
        return tuple(scale * length / velocity for length in lengths[: len(self.b_values)])

    @cached_property
    def initial_log_slip_rate(self) -> float:
        r"""Logarithm of the initial slip rate, :math:`\ln(V/V_*)`."""
        rate = _parse_positive_si_value("slip_rate", self.initial["slip_rate"], "m/s")
        return math.log(rate / self.rig.reference_velocity)

    @property
    def initial_motion_state(self) -> Event | None:
        """Initial state of the motion, computed from the initial slip rate and theta.

        The stress of the spring is chosen so that the slip rate before the first step of the
        loading is the initial slip rate. The property is None if the problem has no initial values.
        """
        if not self.initial:
            return None
        scene, x, states = (
            self.scene,
            self.initial_log_slip_rate,
            self._compute_initial_state_variables(),
        )
        acting, before = (
            scene.segment_sequences_without_jumps[0][0],
            scene.with_segment(Segment(1.0)),
        )
        friction = scene.a * x + sum(states)
        if scene.parts.law.regularised:
            above = (scene.mu_star + friction) / scene.a
            friction = scene.a * math.asinh(0.5 * math.exp(above)) - scene.mu_star
        taken = before.compute_steady_states(0.0, before.build_friction_relation()(friction)[2])
        psis = (
            *map(add, states, taken),
            *taken[len(states) :],
            *scene.parts.loading.initial_unknowns(scene),
        )
        radiated = before.dynamics.radiated_stress(x)
        point = acting.compute_slow_manifold_point(
            friction + radiated + acting.spring_stress_step, psis
        )
        point = (
            Integrator.compute_point_with_slip_rate(acting, point, x) if scene.has_mass else point
        )
        return Event(EventKind.START, None, 0.0, 0.0, point, "", 0, 0.0)

    def _compute_initial_state_variables(self) -> tuple[float, ...]:
        r"""Compute the initial values of the state variables.

        The state variable is :math:`b \ln(\theta/\theta_*)`, which is zero in steady sliding at
        :math:`V_*`.
        """
        stated = self.initial["theta"]
        thetas = stated if isinstance(stated, list) else [stated]
        if len(thetas) != len(self.b_values):
            rule = f"must contain {len(self.b_values)} values, one for each b"
            raise InvalidValue("theta", stated, rule)
        known = zip(self.b_values, thetas, self.steady_thetas_at_reference_velocity, strict=True)
        return tuple(
            b * math.log(_parse_positive_si_value("theta", x, "s") / star) for b, x, star in known
        )


def _parse_positive_si_value(name: str, value: Any, units: str) -> float:
    """Convert a value to SI units and check that the value is positive."""
    found = convert_to_si(name, value, units)
    if not found > 0.0:
        raise InvalidValue(name, value, "must be positive")
    return found


def read_problem(path: Path) -> BenchmarkProblem:
    """Read a benchmark problem from a TOML file.

    Parameters
    ----------
    path : Path
        Path of the file.

    Returns
    -------
    BenchmarkProblem
        Validated problem, whose scene and initial state can be computed without errors.

    Raises
    ------
    DataError
        If the file does not exist or is not a valid TOML file.
    InvalidValue
        If a required key is missing, if a key is unknown, or if a value is invalid.
    """
    check_regular_file("problem", path)
    try:
        stated = tomllib.loads(path.read_text(encoding="utf-8"))
    except RecursionError as error:
        raise DataError(f"{path}: cannot be read as TOML (it is nested too deeply)") from error
    # The TOML parser raises ValueError for wrong syntax, wrong encoding and numbers with too many
    # digits.
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be read as TOML ({shorten_text(error)})") from error
    known = {
        name: kind for name, kind in get_type_hints(BenchmarkProblem).items() if name != "number"
    }
    try:
        for name, value in stated.items():
            if name not in known:
                raise InvalidValue("key", name, "is unknown", choices=known)
            _check_declared_type(name, value, known[name])
        for name in ("title", "law", "quantities", "parameters"):
            if name not in stated:
                raise InvalidValue("problem", [*stated], f"must contain {name}")
        number = int(path.name[:2]) if path.parent == SHIPPED_PROBLEM_FOLDER else 0
        problem = BenchmarkProblem(**stated, number=number)
        _ = problem.scene, problem.initial_motion_state
        return problem
    except InvalidValue as error:
        raise error.with_location(str(path)) from error
    except (
        ArithmeticError,
        AttributeError,
        LookupError,
        TypeError,
        ValueError,
        MotionStopped,
    ) as error:
        rule = f"is not a valid problem ({format_exception(error)})"
        remedy = "Run rsfstudy problems DIR to write example problem files."
        raise InvalidValue("problem", str(path), rule, remedy=remedy) from error


def _check_declared_type(name: str, value: Any, expected_type: Any) -> None:
    """Check that a value of a problem has the declared type.

    Raises
    ------
    InvalidValue
        If the value does not have the declared type.
    """
    try:
        msgspec.convert(value, expected_type)
    except msgspec.ValidationError as error:
        found = _MSGSPEC_TYPE_ERROR_PATTERN.search(str(error))
        if found is None:
            raise InvalidValue(name, value, f"is invalid: {error}") from error
        wanted, actual = (
            _READABLE_NAME_BY_TYPE_NAME.get(kind, kind) for kind in found.groups()[:2]
        )
        place = f"{name}{found[3] or ''}"
        raise InvalidValue(place, value, f"must be {wanted}, not {actual}") from error


def find_shipped_problem_files() -> dict[int, Path]:
    """Return the files of the shipped problems, keyed by problem number.

    Returns
    -------
    dict of int to Path
        Path of each problem file.
    """
    return {int(path.name[:2]): path for path in sorted(SHIPPED_PROBLEM_FOLDER.glob("*.toml"))}


def write_shipped_problems(directory: Path) -> int:
    """Write the shipped problems, their answers and templates to a directory.

    The function creates the folders ``problems``, ``answers`` and ``templates``, and the script
    ``example.py``. A template is a table with the headings of an answer and no values.

    Parameters
    ----------
    directory : Path
        New or empty directory.

    Returns
    -------
    int
        Number of problems.

    Raises
    ------
    InvalidValue
        If the directory is not empty.
    DataError
        If the files cannot be written.
    """
    check_path_is_valid("DIR", directory)
    if directory.exists() and (not directory.is_dir() or any(directory.iterdir())):
        remedy = "Choose a new directory, because existing files are not replaced."
        raise InvalidValue("DIR", str(directory), "already exists", remedy=remedy)
    shipped = find_shipped_problem_files()
    try:
        places = {name: directory / name for name in ("problems", "answers", "templates")}
        for place in places.values():
            place.mkdir(parents=True)
        for path in shipped.values():
            shutil.copyfile(path, places["problems"] / path.name)
            answer = path.with_suffix(".csv")
            shutil.copyfile(answer, places["answers"] / answer.name)
            _write_answer_template(read_problem(path), places["templates"] / answer.name)
        shutil.copyfile(SHIPPED_PROBLEM_FOLDER / "example.txt", directory / "example.py")
    except OSError as error:
        raise DataError(f"{directory}: cannot be written ({error})") from error
    return len(shipped)


def _write_answer_template(problem: BenchmarkProblem, path: Path) -> None:
    """Write a table with the headings and the index column of an answer."""
    empty = [""] * len(problem.quantities)
    rows = (
        [f"{row:.12g}" for row in problem.answer_index_values]
        if problem.answer_index_column_name
        else []
    )
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(problem.answer_column_headings)
        table.writerows([[row, *empty] for row in rows] or [empty])
