"""Problems: what a slider is, how it begins, what loads it, and what is to be told of it."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import lambertw

from rsfstudy.doors import check_file
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.motion.events import Event, Kind
from rsfstudy.motion.regimes import at_rate, on_slow_manifold
from rsfstudy.rig.laboratory import Laboratory
from rsfstudy.rig.units import in_si
from rsfstudy.slider.equations import steady_states_of
from rsfstudy.slider.scene import Scene

#: Where the problems stand, each beside its answer.
SHIPPED = Path(__file__).with_name("problems")
#: What may be asked for: SI units, by what is reported.
SERIES = {
    "time": "s", "friction": "1", "slip_rate": "m/s", "theta": "s", "theta_1": "s", "theta_2": "s",
    "slip": "m", "normal_stress": "Pa", "pore_pressure": "Pa",
}  # fmt: skip
PEAKS = {"event": "1", "time": "s", "slip_rate": "m/s"}
NUMBERS = {
    "critical_stiffness": "Pa/m", "growth_rate": "1/s", "angular_frequency": "1/s",
    "critical_velocity": "m/s", "critical_displacement": "m", "recurrence_interval": "s",
    "static_stress_drop": "Pa", "dynamic_stress_drop": "Pa", "peak_slip_rate": "m/s",
    "slowest_slip_rate": "m/s",
}  # fmt: skip
REPORTS = {"series": SERIES, "peaks": PEAKS, "numbers": NUMBERS}
#: Parameters of a rig by their names here, and units of those that no field of a scene holds.
_RIG = {"normal_stress": "normal_stress", "D_c": "slip_distance", "V_star": "reference_velocity"}
_UNITS = {"radiation_damping": "Pa s/m", "V_c": "m/s", "D_c_2": "m", "V_unstable": "m/s"}


@dataclass(frozen=True, kw_only=True)
class Problem:
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
        others are fields of a scene, or of a laboratory.
    initial : mapping
        ``slip_rate`` and ``theta`` at the beginning (a list for two states); without it, steady
        sliding at V_star.
    loading : list of mapping
        Segments, as `Laboratory.protocol` takes them.
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
        if self.report not in REPORTS:
            raise InvalidValue("report", self.report, "is unknown", choices=REPORTS)
        for name in self.quantities:
            if name not in self.units:
                raise InvalidValue("quantities", name, "is unknown", choices=self.units)
        if self.report == "series" and not self.times:
            raise InvalidValue("times", self.times, "must list the times of a series, in s")
        if self.report == "peaks" and self.count < 1:
            raise InvalidValue("count", self.count, "must be 1 or more: how many peaks to tell")
        for name in ("a", "b", *_RIG):
            if name not in self.parameters:
                raise InvalidValue("parameters", [*self.parameters], f"must state {name}")
        if self.initial and self.initial.keys() != {"slip_rate", "theta"}:
            rule = "must state slip_rate and theta, or nothing"
            raise InvalidValue("initial", [*self.initial], rule)

    @property
    def units(self) -> Mapping[str, str]:
        """SI units of what may be asked for."""
        return REPORTS[self.report]

    @property
    def key(self) -> str:
        """The column that says which row is which."""
        return {"series": "time", "peaks": "event", "numbers": ""}[self.report]

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns of an answer."""
        return (self.key, *self.quantities) if self.key else tuple(self.quantities)

    @property
    def rows(self) -> np.ndarray:
        """What that column holds."""
        rows = self.times if self.report == "series" else range(1, max(self.count, 1) + 1)
        return np.array(rows, dtype=float)

    @property
    def header(self) -> list[str]:
        """Columns of an answer with their units."""
        return [f"{name} ({self.units[name]})" for name in self.columns]

    def si(self, name: str, units: str) -> float:
        """A parameter in SI units."""
        return in_si(name, self.parameters[name], units)

    @cached_property
    def rig(self) -> Laboratory:
        """The scales of the problem, and its spring and mass."""
        stated = {_RIG.get(n, n): v for n, v in self.parameters.items()}
        known = [f.name for f in fields(Laboratory)]
        return Laboratory(**{name: stated[name] for name in known if name in stated})

    @cached_property
    def scene(self) -> Scene:
        """The scene that the problem states."""
        rig, own = self.rig, {*_RIG, *_UNITS, "a", "b", "b_2", "stiffness", "period"}
        rest = {n: v for n, v in self.parameters.items() if n not in own}
        given = {n: self.si(n, unit) for n, unit in _UNITS.items() if n in self.parameters}
        a, b = (float(self.parameters[name]) for name in "ab")
        rest |= {"law": self.law, "a": a}
        if "b_2" in self.parameters:
            ratio = given["D_c_2"] / rig.slip_distance
            both = {"b1_over_a": b / a, "b2_over_a": self.parameters["b_2"] / a}
            rest |= both | {"length_ratio": ratio}
        else:
            rest["b_over_a"] = b / a
        if "phi" in rest:
            rest["normal_stress"] = "variable"
        if self.damping:
            rest["radiation_damping"] = self.damping * rig.reference_velocity
        if "V_c" in given:
            rest["cutoff_velocity_ratio"] = given["V_c"] / rig.reference_velocity
        if "V_unstable" in given:
            period = rest.setdefault("period", 5.0) / (2.0 * math.pi)
            rest["instability_norm"] = given["V_unstable"] * period / rig.slip_distance
        if self.loading:
            rest["loading"] = rig.protocol(self.loading)
        if self.initial and len(self._states) == 1:
            stress = self._stress * rig.normal_stress
            rest |= {"initial_stress": stress, "initial_state": self._states[0]}
        return rig.scene(**rest)

    @cached_property
    def theta_star(self) -> tuple[float, ...]:
        """theta in steady sliding at V_star, of each state, in s."""
        scale = {"perrin_rice_zheng": 2.0}.get(self.law, 1.0)
        if self.law == "composite":
            healing = math.exp(-self.rig.reference_velocity / self.si("V_c", "m/s"))
            scale = math.exp(lambertw(healing).real)
        lengths = [self.si(n, "m") for n in ("D_c", "D_c_2") if n in self.parameters]
        return tuple(scale * length / self.rig.reference_velocity for length in lengths)

    @property
    def theta_at_rest(self) -> tuple[float, ...]:
        """theta in steady sliding at the slip rate of the beginning."""
        return tuple(theta * math.exp(-self._log_rate) for theta in self.theta_star)

    @cached_property
    def b(self) -> tuple[float, ...]:
        """Evolution effect of each state."""
        return tuple(float(self.parameters[n]) for n in ("b", "b_2") if n in self.parameters)

    @cached_property
    def _states(self) -> tuple[float, ...]:
        """State variables at the beginning, 0 in steady sliding at V_star."""
        stated = self.initial["theta"]
        thetas = stated if isinstance(stated, list) else [stated]
        if len(thetas) != len(self.b):
            rule = f"must state {len(self.b)}, one for each b"
            raise InvalidValue("theta", stated, rule)
        return tuple(
            b * math.log(in_si("theta", theta, "s") / star)
            for b, theta, star in zip(self.b, thetas, self.theta_star, strict=True)
        )

    @cached_property
    def _log_rate(self) -> float:
        rate = in_si("slip_rate", self.initial["slip_rate"], "m/s")
        return math.log(rate / self.rig.reference_velocity)

    @property
    def damping(self) -> float:
        """Radiation damping in Pa s/m."""
        known = "radiation_damping" in self.parameters
        return self.si("radiation_damping", "Pa s/m") if known else 0.0

    @cached_property
    def _stress(self) -> float:
        """Spring stress at the beginning over normal stress, above that of steady sliding."""
        a, mu_star = float(self.parameters["a"]), float(self.parameters["mu_star"])
        excess = a * self._log_rate + sum(self._states)
        if self.parameters.get("regularised"):
            excess = a * math.asinh(0.5 * math.exp((mu_star + excess) / a)) - mu_star
        radiated = self.damping * self.rig.reference_velocity / self.rig.normal_stress
        return float(excess + radiated * math.expm1(self._log_rate))

    @property
    def since(self) -> Event | None:
        """The beginning of a motion of two states, which no field of a scene holds; else None."""
        if not self.initial or len(self._states) == 1:
            return None
        scene = self.scene
        others = steady_states_of(scene, 0.0, 0.0)[2:]
        psis = (*self._states, *(scene.parts.loading.beginning or others))
        point = on_slow_manifold(scene, self._stress + scene.spring_stress_step, psis)
        point = at_rate(scene, point, self._log_rate) if scene.has_mass else point
        return Event(Kind.START, None, 0.0, 0.0, point, "", 0, 0.0)


def read(path: Path) -> Problem:
    """The problem of a TOML file.

    Raises
    ------
    DataError
        Where there is no such file of TOML.
    InvalidValue
        For what the file does not say, or says wrongly.
    """
    check_file("problem", path)
    try:
        stated = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeError, tomllib.TOMLDecodeError) as error:
        raise DataError(f"{path}: cannot be read as TOML ({error})") from error
    known = [f.name for f in fields(Problem)]
    try:
        for name in stated:
            if name not in known:
                raise InvalidValue("key", name, "is unknown", choices=known)
        for name in ("title", "law", "quantities", "parameters"):
            if name not in stated:
                raise InvalidValue("problem", [*stated], f"must state {name}")
        number = int(path.name[:2]) if path.parent == SHIPPED else 0
        problem = Problem(**stated, number=number)
        _ = problem.scene
        return problem
    except InvalidValue as error:
        raise error.at(str(path)) from error


def shipped() -> dict[int, Path]:
    """The files of the problems, by number."""
    return {int(path.name[:2]): path for path in sorted(SHIPPED.glob("*.toml"))}
