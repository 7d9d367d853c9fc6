"""The friction that a scene shows along the rows of a record, and its derivatives by parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.fitting.filters import Filter
from rsfstudy.motion import (
    Accuracy,
    MotionStopped,
    Recording,
    WorkMeter,
    friction_coefficient,
    integrate_events,
)
from rsfstudy.quantities import Quantity
from rsfstudy.slider import Scene, history_from_table, replace_field_values
from rsfstudy.status import Status

Values = Mapping[str, float]
#: Step over the size of a parameter, and order.
DifferenceScheme = tuple[float, int]

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
PARAMETER_SYNONYMS = {
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
LAW_SPECIFIC_PARAMETERS = frozenset({"b", "b1", "b2", "slip_distance_2", "law_exponent"})
#: Those whose logarithm is looked for.
LOGARITHMIC_PARAMETERS = frozenset({"slip_distance", "slip_distance_2", "stiffness"})
#: Step over the size of a parameter, and order of central differences. Friction repeats to 1e-11:
#: those of second order then lose 1e-5 where motions are far from unstable, those of fourth order
#: less than 1e-6 everywhere.
QUICK_DIFFERENCES, FINE_DIFFERENCES = (3e-4, 2), (5e-3, 4)
#: Differences over a step and over two must be alike to this part of the largest, else the step
#: shrinks, so often at most: the square of it is what fourth order loses.
_DIFFERENCE_TOLERANCE, _MAX_STEP_REDUCTIONS = 2e-4, 4
#: Standard deviations by which steps of the load point are moved: little enough for derivatives.
STEP_SHIFT_FRACTION = 0.01
#: Beyond these a parameter has no meaning: differences next to them are to one side.
_PARAMETER_DOMAINS = {"law_exponent": (0.0, 1.0), "alpha": (0.0, math.inf)}
#: Step of a over a, of b over the larger of both, of frictions and exponents, and of time over the
#: time in which the load point moves by a micrometre.
_PARAMETER_SCALES = {"mu_star": 0.6, "alpha": 0.5, "law_exponent": 1.0}
#: Right-hand sides of a motion, and of each piece of its loading, beyond which it fits no record:
#: those that do take some thousands, and some twenty a piece. A spring that is stiff for its direct
#: effect takes 2 k x/a, x being the displacement of the window: of twice that so many at most.
_MAX_EVALUATIONS, _MAX_EVALUATIONS_PER_SEGMENT, _MAX_STIFFNESS_EVALUATIONS = 50_000, 60, 100_000


def check_free_parameters(free: Sequence[str]) -> None:
    """Raise InvalidValue for names that are no parameters, or not each once."""
    if not free or len(set(free)) < len(free):
        raise InvalidValue("free", tuple(free), "must name parameters, each once")
    for name in free:
        if name not in PARAMETERS:
            remedy = f"Write {PARAMETER_SYNONYMS[name]}." if name in PARAMETER_SYNONYMS else ""
            raise InvalidValue("free", name, "is no parameter", choices=PARAMETERS, remedy=remedy)


def parameters_of_law(scene: Scene, free: Sequence[str]) -> tuple[str, ...]:
    """Parameters, of those named, that a scene has: one state has b, two have b1, b2 and a second
    slip distance, and a family of laws has an exponent.
    """
    own = scene_to_parameters(scene, 1.0, 1.0)
    return tuple(name for name in free if name in own or name.startswith(("trend", "step_time")))


def check_positive(instance: object, *names: str) -> None:
    """Raise InvalidValue for fields of something that are not positive and finite."""
    for name in names:
        if not 0.0 < getattr(instance, name) < math.inf:
            raise InvalidValue(name, getattr(instance, name), "must be positive and finite")


@dataclass(frozen=True)
class WindowModel:
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
    meter : WorkMeter
    shifted_loadings : sequence of ndarray
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
    meter: WorkMeter
    shifted_loadings: Sequence[np.ndarray] = ()
    filter: Filter | None = None

    @property
    def initial_velocity(self) -> float:
        """Load point velocity at the beginning, in um/s."""
        return float(self.loading[0, 1])

    @cached_property
    def has_normal_stress_change(self) -> bool:
        """True if normal stress changes."""
        return bool(np.ptp(self.loading[:, 2]) > 0.0 or self.loading[:, 3].any())

    def is_linear(self, name: str) -> bool:
        """True for a parameter in which friction is linear, whatever the others."""
        return name.startswith("trend") or (name == "mu_star" and not self.has_normal_stress_change)

    @property
    def max_delay(self) -> float:
        """Time in s by which loading may come late."""
        return float(self.time[0] - self.loading[0, 0])

    def build_scene(self, values: Values) -> Scene:
        """The scene with parameters of a record, in units of its slip distance and velocity."""
        distance, velocity = values["slip_distance"], self.initial_velocity
        columns = np.empty((len(self.loading), 4))
        columns[:, 0] = (self.loading[:, 0] - self.loading[0, 0]) * velocity / distance
        columns[:, 1] = self.loading[:, 1] / velocity
        columns[:, 2] = 1.0 - self.loading[:, 2]
        columns[:, 3] = self.loading[:, 3] * distance / velocity
        history = history_from_table(columns, self.has_normal_stress_change, "record")
        parts = self.scene.parts._replace(loading=history)
        return Scene(replace_field_values(parts, parameters_to_fields(values, velocity)))

    def model_friction(
        self, values: Values, *, refined: bool = False, require_stable: bool = False
    ) -> np.ndarray:
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
        require_stable : bool
            No motion is followed on a spring softer than the critical stiffness, nor with the
            longer of two slip distances first.

        Returns
        -------
        ndarray, shape (rows,)

        Raises
        ------
        MotionStopped
            Where the work budget of the meter is spent.
        """
        budget, nothing = self.meter.budget, np.full(len(self.time), math.nan)
        stiff = 4.0 * values["stiffness"] * float(np.ptp(self.displacement)) / values["a"]
        most = (
            _MAX_EVALUATIONS
            + _MAX_EVALUATIONS_PER_SEGMENT * len(self.loading)
            + int(min(stiff, _MAX_STIFFNESS_EVALUATIONS))
        )
        try:
            scene = self.build_scene(values)
            swapped = values.get("slip_distance_2", math.inf) <= values["slip_distance"]
            if require_stable and (swapped or not scene.stiffness > scene.critical_stiffness):
                return nothing
            late = values.get("step_time", 0.0)
            scale = self.initial_velocity / values["slip_distance"]
            times = self.filter.sample_times(self.time) if self.filter else self.time
            at = np.maximum(times - late - self.loading[0, 0], 0.0) * scale
            accuracy = self.accuracy.refined() if refined else self.accuracy
            recording, end = Recording(sample_times=at), float(at[-1]) * (1.0 + 1e-12)
            self.meter.budget = min(budget, self.meter.evaluations + most)
            for _event in integrate_events(
                scene, accuracy, self.meter, recording=recording, until=end
            ):
                pass
        except MotionStopped as halt:
            if halt.status is Status.WORK_BUDGET_SPENT and self.meter.budget == budget:
                raise
            return nothing
        except InvalidValue:
            return nothing
        finally:
            self.meter.budget = budget
        found = friction_coefficient(recording.table(scene))
        if len(found) != len(times):
            return nothing
        return self.filter.apply(self.time, found) if self.filter else found

    def trend(self, values: Values) -> np.ndarray:
        """The trend along the rows, shape (rows,): ``c_1 x + c_2 x^2 + ...``, x being displacement
        from the first step in um, and c_n in um^-n.
        """
        powers = [(int(name[5:]), c) for name, c in values.items() if name.startswith("trend")]
        return sum((c * self.displacement**n for n, c in powers), np.zeros(len(self.time)))

    def loading_sensitivity(self, values: Values) -> np.ndarray:
        """By how much friction is off along the rows by each of the errors of its loading, shape
        (rows, errors); NaN where there is no such motion.
        """
        if not self.shifted_loadings:
            return np.zeros((len(self.time), 0))
        curves = [
            replace(self, loading=moved).model_friction(values) for moved in self.shifted_loadings
        ]
        return np.asarray(np.array(curves) - self.model_friction(values)).T / STEP_SHIFT_FRACTION

    def jacobian(
        self,
        values: Values,
        free: Sequence[str],
        difference_scheme: DifferenceScheme = FINE_DIFFERENCES,
    ) -> np.ndarray:
        """Derivatives of friction along the rows by parameters, or by the logarithms of those in
        `LOGARITHMIC_PARAMETERS`.

        Those by trends and, at constant normal stress, by `mu_star` are exact. All others are
        central differences of motions, ``d(h) = [f(p + h) - f(p - h)]/(2 h)``, or of fourth order,
        ``[4 d(h) - d(2 h)]/3``, whose step shrinks where d(h) and d(2 h) are not alike.

        Parameters
        ----------
        values : mapping of str to float
        free : sequence of str
        difference_scheme : (float, int)
            Step over the size of a parameter, and order: `QUICK_DIFFERENCES` or `FINE_DIFFERENCES`.

        Returns
        -------
        ndarray, shape (rows, parameters)
            NaN where motions close by cannot be followed.
        """
        return np.column_stack([self._derivative(values, name, difference_scheme) for name in free])

    def _derivative(
        self, values: Values, name: str, difference_scheme: DifferenceScheme
    ) -> np.ndarray:
        """Derivative of friction by one parameter along the rows, shape (rows,)."""
        if name.startswith("trend"):
            return np.asarray(self.displacement ** int(name[5:]))
        if self.is_linear(name):
            return np.ones(len(self.time))
        (part, order), size = difference_scheme, self._parameter_scale(name, values)
        if order == 2:
            return self._central_difference(values, name, part * size, 2.0, refined=False)
        best, least = np.full(len(self.time), math.nan), math.inf
        for _ in range(_MAX_STEP_REDUCTIONS):
            near, far = (
                self._central_difference(values, name, n * part * size, 4.0 / n) for n in (1.0, 2.0)
            )
            largest = float(np.abs(near).max()) or 1.0
            apart = float(np.abs(far - near).max()) / largest
            if apart >= least:  # the last digits of friction are told
                break
            if math.isfinite(apart):
                best, least = (4.0 * near - far) / 3.0, apart
            if least < _DIFFERENCE_TOLERANCE:
                break
            part *= (
                max(0.8 * math.sqrt(_DIFFERENCE_TOLERANCE / least), 0.03)
                if least < math.inf
                else 0.1
            )
        return best

    def _central_difference(
        self, values: Values, name: str, step: float, margin_steps: float, *, refined: bool = True
    ) -> np.ndarray:
        """Derivative by a difference of second order; to one side where a parameter is within so
        many steps of the end of its domain.
        """
        low, high = _PARAMETER_DOMAINS.get(name, (-math.inf, math.inf))
        weights = {1.0: 0.5, -1.0: -0.5}
        if not low + margin_steps * step <= values[name] <= high - margin_steps * step:
            side = 1.0 if values[name] < low + margin_steps * step else -1.0
            weights = {0.0: -1.5 * side, side: 2.0 * side, 2.0 * side: -0.5 * side}
        found = np.zeros(len(self.time))
        for place, weight in weights.items():
            moved = shift_parameter(values, name, place * step)
            found += weight / step * self.model_friction(moved, refined=refined)
        return found

    def _parameter_scale(self, name: str, values: Values) -> float:
        """Size of a parameter, of which the step of a difference is a part."""
        if name in LOGARITHMIC_PARAMETERS:
            return 1.0
        if name == "a":
            return values["a"]
        if name.startswith("b"):
            return max(values["a"], abs(values[name]))
        return _PARAMETER_SCALES.get(name, 1.0 / self.initial_velocity)


def scene_to_parameters(scene: Scene, distance: float, distance_2: float) -> dict[str, float]:
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
    if scene.parts.law.state_count == 1:
        found["b"] = scene.b
    else:
        found |= {name: scene.a * stated[f"{name}_over_a"] for name in ("b1", "b2")}
        found["slip_distance_2"] = distance_2
    named = ("alpha", "law_exponent")
    return found | {name: stated[name] for name in named if stated.get(name) is not None}


def parameters_to_fields(values: Values, velocity: float) -> dict[str, float]:
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


def shift_parameter(values: Values, name: str, change: float) -> dict[str, float]:
    """Values of which one, or its logarithm, is moved."""
    moved = (
        values[name] * math.exp(change) if name in LOGARITHMIC_PARAMETERS else values[name] + change
    )
    return {**values, name: moved}


def to_coordinate(name: str, value: float) -> float:
    """Coordinate of a parameter in searches: itself, or its logarithm."""
    return math.log(value) if name in LOGARITHMIC_PARAMETERS else value


def from_coordinate(name: str, coordinate: float) -> float:
    """Value of a parameter, by its coordinate."""
    return math.exp(coordinate) if name in LOGARITHMIC_PARAMETERS else coordinate


def coordinate_derivative(name: str, value: float) -> float:
    """Derivative of a parameter by its coordinate."""
    return value if name in LOGARITHMIC_PARAMETERS else 1.0
