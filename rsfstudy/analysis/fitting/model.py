"""The friction that a scene shows along the rows of a record, and its derivatives by parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rsfstudy.analysis.fitting.filters import Filter
from rsfstudy.errors import InvalidValue
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.course import follow
from rsfstudy.motion.meter import Halt, Meter
from rsfstudy.motion.readings import friction_coefficient_of
from rsfstudy.motion.recording import Recording
from rsfstudy.quantity import Quantity
from rsfstudy.slider import assembly
from rsfstudy.slider.history import of_samples
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

Values = Mapping[str, float]
#: Step over the size of a parameter, and order.
Differences = tuple[float, int]

#: What may be fitted.
PARAMETERS = {
    about.name: about
    for about in (
        Quantity("a", "$a$", "1", "direct effect parameter"),
        Quantity("b", "$b$", "1", "evolution effect parameter"),
        Quantity("b1", "$b_1$", "1", "evolution effect parameter of the first state"),
        Quantity("b2", "$b_2$", "1", "evolution effect parameter of the second state"),
        Quantity("slip_distance", "$D_c$", "um", "characteristic slip distance"),
        Quantity("slip_distance_2", "$L_2$", "um", "slip distance of the second state"),
        Quantity("mu_star", r"$\mu_*$", "1", "friction coefficient before the first step"),
        Quantity("stiffness", "$k$", "um-1", "stiffness over normal stress"),
        Quantity("alpha", r"$\alpha$", "1", "strength of the normal stress effect on state"),
        Quantity("law_exponent", r"$\epsilon$", "1", "exponent of the family of laws"),
        Quantity("step_time", r"$\Delta t$", "s", "time by which loading comes late"),
        *(
            Quantity(f"trend{n}", f"$c_{n}$", f"um-{n}", f"trend with power {n} of displacement")
            for n in range(1, 6)
        ),
    )
}
#: What others call them.
INSTEAD = {
    **dict.fromkeys(("Dc", "dc", "D_c", "d_c", "L", "dcrit"), "slip_distance"),
    **dict.fromkeys(("Dc1", "L1"), "slip_distance"),
    **dict.fromkeys(("Dc2", "L2", "dc2"), "slip_distance_2"),
    **dict.fromkeys(("mu", "mu0", "mu_0", "f0", "f_0", "mu_ref"), "mu_star"),
    **dict.fromkeys(("k", "K", "kappa", "stiffness_ratio"), "stiffness"),
    **dict.fromkeys(("trend", "slope", "drift", "detrend"), "trend1"),
    **dict.fromkeys(("a_minus_b", "b_over_a"), "a and b, of which both follow"),
    **dict.fromkeys(("eps", "epsilon"), "law_exponent, with law='family'"),
    **dict.fromkeys(("t0", "step"), "step_time"),
}
#: Those that some laws have and others have not.
OF_SOME_LAWS = frozenset({"b", "b1", "b2", "slip_distance_2", "law_exponent"})
#: Those whose logarithm is looked for.
LOGARITHMIC = frozenset({"slip_distance", "slip_distance_2", "stiffness"})
#: Step over the size of a parameter, and order of central differences. Friction repeats to 1e-11:
#: those of second order then lose 1e-5 where motions are far from unstable, those of fourth order
#: less than 1e-6 everywhere.
QUICK, FINE = (3e-4, 2), (5e-3, 4)
#: Differences over a step and over two must be alike to this part of the largest, else the step
#: shrinks, so often at most: the square of it is what fourth order loses.
_ALIKE, _SHRUNK = 2e-4, 4
#: Standard deviations by which steps of the load point are moved: little enough for derivatives.
MOVED = 0.01
#: Beyond these a parameter has no meaning: differences next to them are to one side.
_DOMAINS = {"law_exponent": (0.0, 1.0), "alpha": (0.0, math.inf)}
#: Step of a over a, of b over the larger of both, of frictions and exponents, and of time over the
#: time in which the load point moves by a micrometre.
_SIZES = {"mu_star": 0.6, "alpha": 0.5, "law_exponent": 1.0}
#: Right-hand sides of a motion, and of each piece of its loading, beyond which it fits no record:
#: those that do take some thousands, and some twenty a piece. A spring that is stiff for its direct
#: effect takes 2 k x/a, x being the displacement of the window: of twice that so many at most.
_MOST, _MOST_EACH, _MOST_STIFF = 50_000, 60, 100_000


def check_free(free: Sequence[str]) -> None:
    """Raise InvalidValue for names that are no parameters, or not each once."""
    if not free or len(set(free)) < len(free):
        raise InvalidValue("free", tuple(free), "must name parameters, each once")
    for name in free:
        if name not in PARAMETERS:
            remedy = f"Write {INSTEAD[name]}." if name in INSTEAD else ""
            raise InvalidValue("free", name, "is no parameter", choices=PARAMETERS, remedy=remedy)


def of_law(scene: Scene, free: Sequence[str]) -> tuple[str, ...]:
    """Parameters, of those named, that a scene has: one state has b, two have b1, b2 and a second
    slip distance, and a family of laws has an exponent.
    """
    own = parameters_of(scene, 1.0, 1.0)
    return tuple(name for name in free if name in own or name.startswith(("trend", "step_time")))


def check_positive(of: object, *names: str) -> None:
    """Raise InvalidValue for fields of something that are not positive and finite."""
    for name in names:
        if not 0.0 < getattr(of, name) < math.inf:
            raise InvalidValue(name, getattr(of, name), "must be positive and finite")


@dataclass(frozen=True)
class Model:
    """The model of a window of a record.

    Attributes
    ----------
    scene : Scene
        The law and all that is not fitted.
    time, displacement, friction : ndarray
        Rows of the window: in s, in um from its first step, and 1.
    loading : ndarray
        Pieces as `loading_of` makes them.
    accuracy : Accuracy
    meter : Meter
    moves : sequence of ndarray
        Pieces of loading by steps that are moved (see `moved_steps`).
    filter : Filter, optional
        That friction passed before it was recorded.
    """

    scene: Scene
    time: np.ndarray
    displacement: np.ndarray
    friction: np.ndarray
    loading: np.ndarray
    accuracy: Accuracy
    meter: Meter
    moves: Sequence[np.ndarray] = ()
    filter: Filter | None = None

    @property
    def reference(self) -> float:
        """Load point velocity at the beginning, in um/s."""
        return float(self.loading[0, 1])

    @cached_property
    def is_stressed(self) -> bool:
        """True if normal stress changes."""
        return bool(np.ptp(self.loading[:, 2]) > 0.0 or self.loading[:, 3].any())

    def is_linear(self, name: str) -> bool:
        """True for a parameter in which friction is linear, whatever the others."""
        return name.startswith("trend") or (name == "mu_star" and not self.is_stressed)

    @property
    def latest(self) -> float:
        """Time in s by which loading may come late."""
        return float(self.time[0] - self.loading[0, 0])

    def scene_of(self, values: Values) -> Scene:
        """The scene with parameters of a record, in units of its slip distance and velocity."""
        distance, velocity = values["slip_distance"], self.reference
        columns = np.empty((len(self.loading), 4))
        columns[:, 0] = (self.loading[:, 0] - self.loading[0, 0]) * velocity / distance
        columns[:, 1] = self.loading[:, 1] / velocity
        columns[:, 2] = 1.0 - self.loading[:, 2]
        columns[:, 3] = self.loading[:, 3] * distance / velocity
        history = of_samples(columns, self.is_stressed, "record")
        parts = self.scene.parts._replace(loading=history)
        return Scene(assembly.with_numbers(parts, fields_of(values, velocity)))

    def curve(self, values: Values, *, refined: bool = False, checked: bool = False) -> np.ndarray:
        """Friction along the rows, without trend; NaN where there is no such motion, or where it
        takes far more work than those of records do.

        It is spring stress over normal stress, as a rig reads it, of the motion that begins with
        steady sliding before the first step, at the times of the rows less `step_time`.

        Parameters
        ----------
        values : mapping of str to float
            All parameters, in the units of `PARAMETERS`.
        refined : bool
            At a tenth of all tolerances.
        checked : bool
            No motion is followed on a spring softer than the critical stiffness, nor with the
            longer of two slip distances first.

        Returns
        -------
        ndarray, shape (rows,)

        Raises
        ------
        Halt
            Where the work budget of the meter is spent.
        """
        budget, nothing = self.meter.budget, np.full(len(self.time), math.nan)
        stiff = 4.0 * values["stiffness"] * float(np.ptp(self.displacement)) / values["a"]
        most = _MOST + _MOST_EACH * len(self.loading) + int(min(stiff, _MOST_STIFF))
        try:
            scene = self.scene_of(values)
            swapped = values.get("slip_distance_2", math.inf) <= values["slip_distance"]
            if checked and (swapped or not scene.stiffness > scene.critical_stiffness):
                return nothing
            late = values.get("step_time", 0.0)
            scale = self.reference / values["slip_distance"]
            times = self.filter.sample_times(self.time) if self.filter else self.time
            at = np.maximum(times - late - self.loading[0, 0], 0.0) * scale
            accuracy = self.accuracy.refined() if refined else self.accuracy
            recording, end = Recording(at=at), float(at[-1]) * (1.0 + 1e-12)
            self.meter.budget = min(budget, self.meter.spent + most)
            for _event in follow(scene, accuracy, self.meter, recording=recording, until=end):
                pass
        except Halt as halt:
            if halt.status is Status.WORK_BUDGET_SPENT and self.meter.budget == budget:
                raise
            return nothing
        except InvalidValue:
            return nothing
        finally:
            self.meter.budget = budget
        found = friction_coefficient_of(recording.seen(scene))
        if len(found) != len(times):
            return nothing
        return self.filter.apply(self.time, found) if self.filter else found

    def trend(self, values: Values) -> np.ndarray:
        """The trend along the rows, shape (rows,): ``c_1 x + c_2 x^2 + ...``, x being displacement
        from the first step in um, and c_n in um^-n.
        """
        powers = [(int(name[5:]), c) for name, c in values.items() if name.startswith("trend")]
        return sum((c * self.displacement**n for n, c in powers), np.zeros(len(self.time)))

    def by_loading(self, values: Values) -> np.ndarray:
        """By how much friction is off along the rows by each of the errors of its loading, shape
        (rows, errors); NaN where there is no such motion.
        """
        if not self.moves:
            return np.zeros((len(self.time), 0))
        curves = [replace(self, loading=moved).curve(values) for moved in self.moves]
        return np.asarray(np.array(curves) - self.curve(values)).T / MOVED

    def jacobian(
        self, values: Values, free: Sequence[str], differences: Differences = FINE
    ) -> np.ndarray:
        """Derivatives of friction along the rows by parameters, or by the logarithms of those in
        `LOGARITHMIC`.

        Those by trends and, at constant normal stress, by `mu_star` are exact. All others are
        central differences of motions, ``d(h) = [f(p + h) - f(p - h)]/(2 h)``, or of fourth order,
        ``[4 d(h) - d(2 h)]/3``, whose step shrinks where d(h) and d(2 h) are not alike.

        Parameters
        ----------
        values : mapping of str to float
        free : sequence of str
        differences : (float, int)
            Step over the size of a parameter, and order: `QUICK` or `FINE`.

        Returns
        -------
        ndarray, shape (rows, parameters)
            NaN where motions close by cannot be followed.
        """
        return np.column_stack([self._derivative(values, name, differences) for name in free])

    def _derivative(self, values: Values, name: str, differences: Differences) -> np.ndarray:
        """Derivative of friction by one parameter along the rows, shape (rows,)."""
        if name.startswith("trend"):
            return np.asarray(self.displacement ** int(name[5:]))
        if self.is_linear(name):
            return np.ones(len(self.time))
        (part, order), size = differences, self._size(name, values)
        if order == 2:
            return self._difference(values, name, part * size, 2.0, refined=False)
        best, least = np.full(len(self.time), math.nan), math.inf
        for _ in range(_SHRUNK):
            near, far = (
                self._difference(values, name, n * part * size, 4.0 / n) for n in (1.0, 2.0)
            )
            largest = float(np.abs(near).max()) or 1.0
            apart = float(np.abs(far - near).max()) / largest
            if apart >= least:  # the last digits of friction are told
                break
            if math.isfinite(apart):
                best, least = (4.0 * near - far) / 3.0, apart
            if least < _ALIKE:
                break
            part *= max(0.8 * math.sqrt(_ALIKE / least), 0.03) if least < math.inf else 0.1
        return best

    def _difference(
        self, values: Values, name: str, step: float, reach: float, *, refined: bool = True
    ) -> np.ndarray:
        """Derivative by a difference of second order; to one side where a parameter is within so
        many steps of the end of its domain.
        """
        low, high = _DOMAINS.get(name, (-math.inf, math.inf))
        weights = {1.0: 0.5, -1.0: -0.5}
        if not low + reach * step <= values[name] <= high - reach * step:
            side = 1.0 if values[name] < low + reach * step else -1.0
            weights = {0.0: -1.5 * side, side: 2.0 * side, 2.0 * side: -0.5 * side}
        found = np.zeros(len(self.time))
        for place, weight in weights.items():
            moved = shifted(values, name, place * step)
            found += weight / step * self.curve(moved, refined=refined)
        return found

    def _size(self, name: str, values: Values) -> float:
        """Size of a parameter, of which the step of a difference is a part."""
        if name in LOGARITHMIC:
            return 1.0
        if name == "a":
            return values["a"]
        if name.startswith("b"):
            return max(values["a"], abs(values[name]))
        return _SIZES.get(name, 1.0 / self.reference)


def parameters_of(scene: Scene, distance: float, distance_2: float) -> dict[str, float]:
    """Parameters of a scene, in units of records, by its slip distance and that of the second of
    two states in um.
    """
    stated = scene.as_dict()
    found = {
        "a": scene.a,
        "slip_distance": distance,
        "mu_star": scene.mu_star,
        "stiffness": scene.stiffness / distance,
    }
    if scene.parts.law.states == 1:
        found["b"] = scene.b
    else:
        found |= {name: scene.a * stated[f"{name}_over_a"] for name in ("b1", "b2")}
        found["slip_distance_2"] = distance_2
    named = ("alpha", "law_exponent")
    return found | {name: stated[name] for name in named if stated.get(name) is not None}


def fields_of(values: Values, velocity: float) -> dict[str, float]:
    """Fields of a scene with these parameters of a record, in units of its slip distance and of a
    velocity in um/s.
    """
    a, distance = values["a"], values["slip_distance"]
    fields = {
        "a": a,
        "mu_star": values["mu_star"],
        "stiffness": values["stiffness"] * distance,
        "reference_rate": velocity / distance,
    }
    fields |= {f"{n}_over_a": values[n] / a for n in ("b", "b1", "b2") if n in values}
    if "slip_distance_2" in values:
        fields["length_ratio"] = values["slip_distance_2"] / distance
    return fields | {name: values[name] for name in ("alpha", "law_exponent") if name in values}


def shifted(values: Values, name: str, by: float) -> dict[str, float]:
    """Values of which one, or its logarithm, is moved."""
    moved = values[name] * math.exp(by) if name in LOGARITHMIC else values[name] + by
    return {**values, name: moved}


def coordinate(name: str, value: float) -> float:
    """Coordinate of a parameter in searches: itself, or its logarithm."""
    return math.log(value) if name in LOGARITHMIC else value


def value_of(name: str, coordinate: float) -> float:
    """Value of a parameter, by its coordinate."""
    return math.exp(coordinate) if name in LOGARITHMIC else coordinate


def slope(name: str, value: float) -> float:
    """Derivative of a parameter by its coordinate."""
    return value if name in LOGARITHMIC else 1.0
