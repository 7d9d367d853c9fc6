"""Problems: what a slider is, how it begins, what loads it, and what is to be told of it; and the
files of problems, answers and templates that are written for other codes.
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

from rsfstudy.error_boundary import check_regular_file, format_exception
from rsfstudy.errors import DataError, InvalidValue, shorten
from rsfstudy.motion import Event, EventKind, MotionStopped, manifold_point, with_slip_rate
from rsfstudy.parts import Segment
from rsfstudy.paths import check_path
from rsfstudy.rig import Rig, convert_to_si
from rsfstudy.slider import Scene, compute_steady_states, field_defaults, friction_relation

#: Where the problems stand, each beside its answer.
PROBLEM_FOLDER = Path(__file__).with_name("problems")
#: What may be asked for: SI units, by what is reported.
SERIES_UNITS = {
    "time": "s", "friction": "1", "slip_rate": "m/s", "theta": "s", "theta_1": "s", "theta_2": "s",
    "slip": "m", "normal_stress": "Pa", "pore_pressure": "Pa",
}  # fmt: skip
PEAK_UNITS = {"event": "1", "time": "s", "slip_rate": "m/s"}
NUMBER_UNITS = {
    "critical_stiffness": "Pa/m", "growth_rate": "1/s", "angular_frequency": "1/s",
    "critical_velocity": "m/s", "critical_displacement": "m", "recurrence_interval": "s",
    "static_stress_drop": "Pa", "dynamic_stress_drop": "Pa", "peak_slip_rate": "m/s",
    "slowest_slip_rate": "m/s",
}  # fmt: skip
REPORT_UNITS = {"series": SERIES_UNITS, "peaks": PEAK_UNITS, "numbers": NUMBER_UNITS}
#: What must be stated, and what a rig calls that, or what else it may be told.
_REQUIRED_RIG_FIELDS = {
    "normal_stress": "normal_stress",
    "D_c": "slip_distance",
    "V_star": "reference_velocity",
}
_RIG_FIELDS = {**_REQUIRED_RIG_FIELDS, "stiffness": "stiffness", "period": "period", "mass": "mass"}
#: Units of parameters that no field of a scene holds.
_PARAMETER_UNITS = {
    "b": "1", "b_2": "1", "D_c_2": "m", "radiation_damping": "Pa s/m", "V_c": "m/s",
    "V_unstable": "m/s",
}  # fmt: skip
#: Laws whose theta goes as exp(Theta/b).
_LAWS_WITH_THETA = (
    "slip", "slowness", "family", "perrin_rice_zheng", "composite", "two_slip_states",
    "two_slowness_states",
)  # fmt: skip


#: How msgspec names a mismatch, and its kinds of values in words.
_TYPE_ERROR_PATTERN = re.compile(r"Expected `(\w+)`, got `(\w+)`(?: - at `\$(.*)`)?")
_TYPE_DESCRIPTIONS = {
    "array": "a list", "object": "a table", "str": "a text", "int": "a whole number",
    "float": "a number", "bool": "true or false", "null": "nothing", "date": "a date",
}  # fmt: skip
#: Largest number of digits of an answer, and of peaks.
_MAX_DIGITS, _MAX_PEAKS = 15, 10_000


@dataclass(frozen=True, kw_only=True)
class BenchmarkProblem:
    """A problem, as its file states it.

    Attributes
    ----------
    title : str
    law : str
        State evolution law.
    equations, conventions : str
        The equations, and what codes do not agree upon.
    report : {"series", "peaks", "numbers"}
        What to tell: values at times; times and heights of maxima of slip rate; or numbers.
    quantities : list of str
        Columns of the answer.
    parameters : mapping
        Numbers, and texts with units: ``a``, ``b``, ``D_c``, ``V_star``, ``mu_star``,
        ``normal_stress``, and ``b_2``, ``D_c_2``, ``radiation_damping``, ``V_c``, ``V_unstable``;
        others are fields of a scene, or of a rig.
    initial : mapping
        ``slip_rate`` and ``theta`` at the beginning (a list for two states); without it, steady
        sliding at V_star.
    loading : list of mapping
        Segments, as `Rig.protocol` takes them.
    times : list of float
        In s, of a series.
    count : int
        Peaks to tell.
    digits : int
        Digits of the answer that two ways agree upon.
    number : int
        Of the problem; 0 for one of the user's own.
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
        if self.report not in REPORT_UNITS:
            raise InvalidValue("report", self.report, "is unknown", choices=REPORT_UNITS)
        if not self.quantities:
            rule = "must list at least one quantity"
            raise InvalidValue("quantities", self.quantities, rule, choices=self.units)
        if not 1 <= self.digits <= _MAX_DIGITS:
            raise InvalidValue("digits", self.digits, f"must lie between 1 and {_MAX_DIGITS}")
        for name in self.quantities:
            if name not in self.units:
                raise InvalidValue("quantities", name, "is unknown", choices=self.units)
        times = np.array(self.times, dtype=float)
        if self.report == "series" and not (len(times) and np.isfinite(times).all()):
            raise InvalidValue("times", self.times, "must list the times of a series, in s")
        if (np.diff(times, prepend=-1e-300) <= 0.0).any():
            raise InvalidValue("times", self.times, "must increase, from 0 or later")
        if self.report == "peaks" and not 1 <= self.count <= _MAX_PEAKS:
            rule = f"must lie between 1 and {_MAX_PEAKS:,}: it is the number of peaks to report"
            raise InvalidValue("count", self.count, rule)
        if self.law not in _LAWS_WITH_THETA:
            raise InvalidValue("law", self.law, "is unknown", choices=_LAWS_WITH_THETA)
        two = ("b_2", "D_c_2") if self.law.startswith("two") else ()
        for name in ("a", "b", *two, *_REQUIRED_RIG_FIELDS):
            if name not in self.parameters:
                raise InvalidValue("parameters", [*self.parameters], f"must state {name}")
        if self.initial and self.initial.keys() != {"slip_rate", "theta"}:
            rule = "must state slip_rate and theta, or nothing"
            raise InvalidValue("initial", [*self.initial], rule)
        if self.initial and "phi" in self.parameters:
            rule = "has no meaning beside phi: it begins with normal_stress, in steady sliding"
            raise InvalidValue("initial", [*self.initial], rule)

    @property
    def units(self) -> Mapping[str, str]:
        """SI units of what may be asked for."""
        return REPORT_UNITS[self.report]

    @property
    def index_column(self) -> str:
        """The column that says which row is which."""
        return {"series": "time", "peaks": "event", "numbers": ""}[self.report]

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns of an answer."""
        return (
            (self.index_column, *self.quantities) if self.index_column else tuple(self.quantities)
        )

    @property
    def index_values(self) -> np.ndarray:
        """Numbers of that column: times in s, or numbers of peaks."""
        rows = self.times if self.report == "series" else range(1, max(self.count, 1) + 1)
        return np.array(rows, dtype=float)

    @property
    def header(self) -> list[str]:
        """Columns of an answer with their units."""
        return [f"{name} ({self.units[name]})" for name in self.columns]

    @cached_property
    def rig(self) -> Rig:
        """The scales of the problem, and its spring and mass."""
        return Rig(**{_RIG_FIELDS[n]: v for n, v in self.parameters.items() if n in _RIG_FIELDS})

    @cached_property
    def si_parameters(self) -> Mapping[str, float]:
        """Parameters that no field of a scene holds, in SI units."""
        stated = self.parameters
        return {
            n: convert_to_si(n, stated[n], units)
            for n, units in _PARAMETER_UNITS.items()
            if n in stated
        }

    @property
    def b(self) -> tuple[float, ...]:
        """Evolution effect of each state."""
        return tuple(
            self.si_parameters[name] for name in ("b", "b_2") if name in self.si_parameters
        )

    @property
    def radiation_damping(self) -> float:
        """Radiation damping in Pa s/m."""
        return self.si_parameters.get("radiation_damping", 0.0)

    @cached_property
    def scene(self) -> Scene:
        """The scene that the problem states, but for how it begins."""
        rig, si, a = self.rig, self.si_parameters, _positive_in_si("a", self.parameters["a"], "1")
        fields = {
            n: v for n, v in self.parameters.items() if n not in {*_RIG_FIELDS, *_PARAMETER_UNITS}
        }
        fields |= {"law": self.law, "a": a}
        if len(self.b) == 1:
            fields["b_over_a"] = self.b[0] / a
        else:
            fields |= {f"b{i}_over_a": b / a for i, b in enumerate(self.b, start=1)}
            fields["length_ratio"] = si["D_c_2"] / rig.slip_distance
        if "phi" in fields:
            fields["normal_stress"] = "variable"
        if self.radiation_damping:
            fields["radiation_damping"] = self.radiation_damping * rig.reference_velocity
        if "V_c" in si:
            fields["cutoff_velocity_ratio"] = si["V_c"] / rig.reference_velocity
        if "V_unstable" in si:
            period = rig.period or field_defaults()["period"]
            norm = si["V_unstable"] * period / (2.0 * math.pi * rig.slip_distance)
            fields["instability_norm"] = norm
        if self.loading:
            fields["loading"] = rig.protocol(self.loading)
        return rig.scene(**fields)

    @property
    def theta_star(self) -> tuple[float, ...]:
        """theta in steady sliding at V_star, of each state, in s."""
        velocity = self.rig.reference_velocity
        scale = 2.0 if self.law == "perrin_rice_zheng" else 1.0
        if self.law == "composite":
            scale = math.exp(lambertw(math.exp(-velocity / self.si_parameters["V_c"])).real)
        lengths = self.rig.slip_distance, self.si_parameters.get("D_c_2", math.nan)
        return tuple(scale * length / velocity for length in lengths[: len(self.b)])

    @cached_property
    def log_slip_rate(self) -> float:
        """ln(V/V_star) at the beginning."""
        rate = _positive_in_si("slip_rate", self.initial["slip_rate"], "m/s")
        return math.log(rate / self.rig.reference_velocity)

    @property
    def initial_event(self) -> Event | None:
        """The beginning of the motion, where that is stated: a stress of the spring with which slip
        rate is the one stated, before any step.
        """
        if not self.initial:
            return None
        scene, x, states = self.scene, self.log_slip_rate, self._initial_states()
        acting, before = scene.continuous_segments[0][0], scene.with_segment(Segment(1.0))
        friction = scene.a * x + sum(states)
        if scene.parts.law.regularised:
            above = (scene.mu_star + friction) / scene.a
            friction = scene.a * math.asinh(0.5 * math.exp(above)) - scene.mu_star
        taken = compute_steady_states(before, 0.0, friction_relation(before)(friction)[2])
        psis = (
            *map(add, states, taken),
            *taken[len(states) :],
            *scene.parts.loading.initial_unknowns(scene),
        )
        radiated = before.dynamics.radiated_stress(x)
        point = manifold_point(acting, friction + radiated + acting.spring_stress_step, psis)
        point = with_slip_rate(acting, point, x) if scene.has_mass else point
        return Event(EventKind.START, None, 0.0, 0.0, point, "", 0, 0.0)

    def _initial_states(self) -> tuple[float, ...]:
        """State variables at the beginning, 0 in steady sliding at V_star."""
        stated = self.initial["theta"]
        thetas = stated if isinstance(stated, list) else [stated]
        if len(thetas) != len(self.b):
            rule = f"must state {len(self.b)}, one for each b"
            raise InvalidValue("theta", stated, rule)
        known = zip(self.b, thetas, self.theta_star, strict=True)
        return tuple(b * math.log(_positive_in_si("theta", x, "s") / star) for b, x, star in known)


def _positive_in_si(name: str, value: Any, units: str) -> float:
    found = convert_to_si(name, value, units)
    if not found > 0.0:
        raise InvalidValue(name, value, "must be positive")
    return found


def read_problem(path: Path) -> BenchmarkProblem:
    """The problem of a TOML file.

    Raises
    ------
    DataError
        Where there is no such file of TOML.
    InvalidValue
        For what the file does not say, or says wrongly.
    """
    check_regular_file("problem", path)
    try:
        stated = tomllib.loads(path.read_text(encoding="utf-8"))
    except RecursionError as error:
        raise DataError(f"{path}: cannot be read as TOML (it is nested too deeply)") from error
    except (OSError, ValueError) as error:  # of the text, its encoding or the digits of a number
        raise DataError(f"{path}: cannot be read as TOML ({shorten(error)})") from error
    known = {
        name: kind for name, kind in get_type_hints(BenchmarkProblem).items() if name != "number"
    }
    try:
        for name, value in stated.items():
            if name not in known:
                raise InvalidValue("key", name, "is unknown", choices=known)
            _check_type(name, value, known[name])
        for name in ("title", "law", "quantities", "parameters"):
            if name not in stated:
                raise InvalidValue("problem", [*stated], f"must state {name}")
        number = int(path.name[:2]) if path.parent == PROBLEM_FOLDER else 0
        problem = BenchmarkProblem(**stated, number=number)
        _ = problem.scene, problem.initial_event
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
        rule = f"cannot be posed ({format_exception(error)})"
        remedy = "rsfstudy problems DIR writes files of problems to begin with."
        raise InvalidValue("problem", str(path), rule, remedy=remedy) from error


def _check_type(name: str, value: Any, kind: Any) -> None:
    """Raise ``InvalidValue`` if a value of a problem does not have the declared type."""
    try:
        msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        found = _TYPE_ERROR_PATTERN.search(str(error))
        if found is None:
            raise InvalidValue(name, value, str(error)) from error
        wanted, actual = (_TYPE_DESCRIPTIONS.get(kind, kind) for kind in found.groups()[:2])
        place = f"{name}{found[3] or ''}"
        raise InvalidValue(place, value, f"must be {wanted}, not {actual}") from error


def shipped_problems() -> dict[int, Path]:
    """The files of the problems, by number."""
    return {int(path.name[:2]): path for path in sorted(PROBLEM_FOLDER.glob("*.toml"))}


def write_problems(directory: Path) -> int:
    """Write all problems into ``problems``, their answers into ``answers``, a table to be filled
    for each into ``templates``, and ``example.py``.

    Returns
    -------
    int
        Number of problems.

    Raises
    ------
    InvalidValue
        Where the directory is not empty.
    DataError
        Where it cannot be written.
    """
    check_path("DIR", directory)
    if directory.exists() and (not directory.is_dir() or any(directory.iterdir())):
        remedy = "Name a new one: nothing is replaced."
        raise InvalidValue("DIR", str(directory), "is there already", remedy=remedy)
    shipped = shipped_problems()
    try:
        places = {name: directory / name for name in ("problems", "answers", "templates")}
        for place in places.values():
            place.mkdir(parents=True)
        for path in shipped.values():
            shutil.copyfile(path, places["problems"] / path.name)
            answer = path.with_suffix(".csv")
            shutil.copyfile(answer, places["answers"] / answer.name)
            _write_template(read_problem(path), places["templates"] / answer.name)
        shutil.copyfile(PROBLEM_FOLDER / "example.txt", directory / "example.py")
    except OSError as error:
        raise DataError(f"{directory}: cannot be written ({error})") from error
    return len(shipped)


def _write_template(problem: BenchmarkProblem, path: Path) -> None:
    """The header of an answer, and which row is which."""
    empty = [""] * len(problem.quantities)
    rows = [f"{row:.12g}" for row in problem.index_values] if problem.index_column else []
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(problem.header)
        table.writerows([[row, *empty] for row in rows] or [empty])
