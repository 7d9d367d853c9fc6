"""Transient of friction after a step of normal stress at a moving load point.

The evaluation follows Linker and Dieterich (1992).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from rsfstudy.analysis.settling import settled_flag
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Outcome
from rsfstudy.measures._records import KEPT, Recorded, errors_of, recorded
from rsfstudy.measures._single_step import check_leaves_alone
from rsfstudy.motion.accuracy import ROUNDING, Accuracy
from rsfstudy.motion.course import follow
from rsfstudy.motion.events import Event
from rsfstudy.motion.meter import Meter
from rsfstudy.motion.readings import friction_coefficient_of
from rsfstudy.motion.recording import OBSERVED, READ, Recording, along_path
from rsfstudy.quantity import Output
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: Part of the record, at its end, over which friction must stay, and within which part of what it
#: is at `fit_from`.
_LAST, _STAYS = 0.1, 0.01
#: ln(V/V_*) within which slip rate must be again where reading begins: the spring has then taken up
#: what strength changed by.
_TAKEN_UP = math.log(2.0)
#: How often a motion is followed to a slip, each time as long as its slip rate says, and the least
#: ln(V/V_*) that is taken for one.
_HOPS, _SLOWEST = 3, -600.0
#: Direct change over mu_* that is no more than rounding.
_NONE = 10.0 * ROUNDING

_OUTPUTS = (
    Output(
        "apparent_alpha",
        r"$\alpha$",
        "1",
        "normal stress effect on the state, as read off",
        error=True,
    ),
    Output(
        "apparent_slip_distance",
        "$D_c$",
        "1",
        "slip over which the transient of friction falls to 1/e, as read off",
        "D_c",
        error=True,
    ),
    Output(
        "evolution_left",
        r"$\Delta\mu(D_c)/\Delta\mu(0)$",
        "1",
        "part of the direct change that is left of the transient after a slip of D_c",
        error=True,
    ),
    Output(
        "direct_change",
        r"$\Delta\mu(0)$",
        "1",
        "change of friction at once, less the direct effect of slip rate",
    ),
    Output("settled", "", "1", "whether friction has settled at the end of the record"),
    Output(
        "closed_form_departure",
        "",
        "1",
        "largest departure of friction, where it is read, from that of a stiff slider",
    ),
    *recorded(*KEPT),
)


class _Record(NamedTuple):
    """Record after a step of normal stress.

    Attributes
    ----------
    begin : Event
        Beginning of the record, immediately after the step.
    rows : ndarray
        Recorded samples.
    friction : mapping of float to float
        Friction at the slips at which it is read. Empty if the spring has not followed the change
        of strength.
    """

    begin: Event
    rows: np.ndarray
    friction: Mapping[float, float]

    @property
    def after(self) -> float:
        """Friction at the end of the record."""
        return float(friction_coefficient_of(self.rows[-1:])[0])

    def left(self, slip: float) -> float:
        """Return the remaining transient of friction at a slip."""
        return self.friction.get(slip, math.nan) - self.after


@dataclass(frozen=True)
class NormalStressTransient(Recorded):
    """Transient of friction after a step of imposed normal stress by a ratio r.

    The load point moves at V_* throughout. An exponential is fitted to the remaining transient at
    two slips, and gives the slip distance. The size of the transient follows by extrapolation to
    the step, and alpha is this size divided by -ln r. The transient of a rigid slider is -alpha ln
    r exp(-slip/D_c) under the slip law, and b ln{1 + [r^(-alpha/b) - 1] exp(-slip/D_c)} under the
    slowness law. The fitted alpha therefore equals the parameter alpha only under the slip law.

    Parameters
    ----------
    fit_from, fit_to : float
        Slips since the step at which the exponential is read, in D_c. At the first slip, the spring
        must have followed the change of strength, so that slip rate is V_* within a factor of two.
    record : float
        Load point displacement of the record, in D_c. Friction at its end is taken as steady.
    phases : int
        Number of points of the record along ``phase``.

    References
    ----------
    Linker and Dieterich (1992), J. Geophys. Res. 97, 4923-4940.
    """

    fit_from: float = 0.5
    fit_to: float = 1.5
    record: float = 30.0
    phases: int = 300
    name: ClassVar[str] = "normal_stress_transient"
    headline = "apparent_alpha"
    typical_work = 4_000
    outputs = _OUTPUTS

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 < self.fit_from < self.fit_to:
            rule = "must be greater than 0 and less than fit_to"
            raise InvalidValue("fit_from", self.fit_from, rule)
        if not self.fit_to + 1.0 <= self.record < math.inf:
            rule = "must exceed fit_to by 1 D_c at least, and be finite"
            raise InvalidValue("record", self.record, rule)

    def scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """The numbers themselves, of a transient that errs by what a is beside its size where it is
        read last.
        """
        ratio = 1.0 + scene.parts.loading.segments[0].normal_stress
        distance = values["apparent_slip_distance"]
        size = abs(values["apparent_alpha"] * math.log(ratio)) * math.exp(-self.fit_to / distance)
        part = 1.0 + scene.a / max(size, ROUNDING * scene.a)
        names = ("apparent_alpha", "apparent_slip_distance", "evolution_left")
        return {name: part * abs(values[name]) for name in names}

    def find(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """Compute the transient, and its errors from a second motion.

        The second motion has smaller tolerances.
        """
        check_leaves_alone(scene)
        step = scene.parts.loading.segments[0]
        if not step.normal_stress:
            return Outcome(Status.NO_STEP, message="normal stress does not change at once")
        why = self._speaks_against(scene)
        if why:
            return Outcome(Status.NOT_APPLICABLE, message=why)
        record = self._follow(scene, accuracy, meter)
        again = self._follow(scene, accuracy.refined(), meter)
        if record is None or again is None:
            why = f"slip does not come to {max(self.fit_to, 1.0):g} D_c, where friction is read"
            return Outcome(Status.NOT_APPLICABLE, message=f"{why}, within record = {self.record:g}")
        shown = self._shown(scene, record)
        values, refined = self._read(scene, record), self._read(scene, again)
        if not values or not refined:
            span = f"{self.fit_from:g} to {self.fit_to:g} D_c of slip"
            why = f"from {span} friction does not decay, or is still that of loading or unloading"
            return Outcome(Status.NOT_APPLICABLE, shown, why)
        errors = errors_of(
            values, refined, self._by_friction(scene, record, values), scene, accuracy
        )
        direct = _direct(scene, record)
        if abs(direct) <= _NONE * scene.mu_star:
            why = "friction does not change at once, so that no part of that can be left"
            del values["evolution_left"], errors["evolution_left_error"]
            return Outcome(Status.NOT_APPLICABLE, {**values, **errors, **shown}, why)
        rounded = ROUNDING * scene.mu_star / abs(direct)
        errors["evolution_left_error"] += rounded * abs(values["evolution_left"])
        return Outcome(Status.OK, {**values, **errors, **shown})

    def _speaks_against(self, scene: Scene) -> str:
        """Return the reason why the transient cannot be read, or an empty string."""
        step, coupling = scene.parts.loading.segments[0], scene.parts.normal_stress.coupling
        if step.load_velocity != 1.0 or step.displacement:
            return "the load point does not move on at V_* as before"
        if coupling is None or coupling[0] or scene.pressure_source.unknowns:
            return "effective normal stress follows shear stress or pore pressure"
        if step.duration < self.record:
            return "normal stress does not stay so for all of the record"
        return ""

    def _follow(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> _Record | None:
        """Record the motion.

        The result is None if slip does not reach the values at which friction is read.
        """
        recording = Recording()
        begin, *_others = follow(
            scene, accuracy, meter, clock=True, recording=recording, until=self.record
        )
        rows = recording.seen(scene)
        slip = rows[:, OBSERVED.index("slip")]
        if slip.max() < max(self.fit_to, 1.0):
            return None
        rate = rows[:, OBSERVED.index("log10_slip_rate")]
        taken_up = abs(np.interp(self.fit_from, slip, rate)) * math.log(10.0) <= _TAKEN_UP
        return _Record(
            begin, rows, self._at_slips(scene, rows, accuracy, meter) if taken_up else {}
        )

    def _at_slips(
        self, scene: Scene, rows: np.ndarray, accuracy: Accuracy, meter: Meter
    ) -> dict[float, float]:
        """Return friction at the slips at which it is read.

        The recorded rows give an estimate of the time at which a slip is reached. The motion is
        then followed to this time, and the time is corrected with the slip rate. Friction is not
        interpolated between integration steps.
        """
        found, elapsed, slipped = dict[float, float](), 0.0, 0.0
        stepped, start = scene.acting(0), None
        stress = 1.0 + scene.parts.loading.segments[0].normal_stress
        for slip in sorted({self.fit_from, 1.0, self.fit_to}):
            wait = float(np.interp(slip, rows[:, OBSERVED.index("slip")], rows[:, 0])) - elapsed
            for _ in range(_HOPS):
                if 0.0 < wait <= self.record - elapsed:
                    *_earlier, end = follow(stepped, accuracy, meter, start=start, until=wait)
                    elapsed, slipped, start = elapsed + end.time, slipped + end.slip, end.point
                log_slip_rate = max(end.point.log_slip_rate, _SLOWEST)
                wait = (slip - slipped) / math.exp(log_slip_rate)
            # spring stress rises by K (V_0/V - 1) per unit slip
            pulled = scene.stiffness * math.expm1(-log_slip_rate) / stress
            found[slip] = end.point.reading + pulled * (slip - slipped)
        return found

    def _read(self, scene: Scene, record: _Record) -> dict[str, float]:
        """Return the numbers that are read from the record.

        The result is empty if the remaining strength change does not fit an exponential, or if the
        spring has not followed the change of strength.
        """
        first, last = record.left(self.fit_from), record.left(self.fit_to)
        if not first or not 0.0 < last / first < 1.0:
            return {}
        distance = (self.fit_to - self.fit_from) / math.log(first / last)
        size = first * math.exp(self.fit_from / distance)
        ratio = 1.0 + scene.parts.loading.segments[0].normal_stress
        direct = _direct(scene, record)
        return {
            "apparent_alpha": -size / math.log(ratio),
            "apparent_slip_distance": distance,
            "evolution_left": record.left(1.0) / direct if direct else math.nan,
        }

    def _by_friction(
        self, scene: Scene, record: _Record, values: Mapping[str, float]
    ) -> dict[str, float]:
        """Change of each number by that of the friction it is read from: at `fit_from`, `fit_to`
        and D_c, each less that at the end, which may err as much.
        """
        first, last = abs(record.left(self.fit_from)), abs(record.left(self.fit_to))
        distance, direct = values["apparent_slip_distance"], _direct(scene, record)
        longer = distance * distance / (self.fit_to - self.fit_from) * (1.0 / first + 1.0 / last)
        larger = 1.0 / first + self.fit_from * longer / (distance * distance)
        return {
            "apparent_alpha": 2.0 * values["apparent_alpha"] * larger,
            "apparent_slip_distance": 2.0 * longer,
            "evolution_left": 2.0 / direct if direct else math.nan,
        }

    def _shown(self, scene: Scene, record: _Record) -> dict[str, float | np.ndarray]:
        """Return the direct change of friction, the flag, the departure and the record."""
        rows, friction = record.rows, friction_coefficient_of(record.rows)
        late = rows[:, 0] >= (1.0 - _LAST) * self.record
        is_flat = bool(np.ptp(friction[late]) < _STAYS * abs(record.left(self.fit_from)))
        path = along_path(rows, self.phases, READ)
        return {
            "direct_change": _direct(scene, record),
            "settled": settled_flag(scene.acting(-1), is_flat=is_flat),
            "closed_form_departure": self._departure(scene, record),
            "time": path["time"],
            "load_point_displacement": path["time"],
            "slip": path["slip"],
            "friction_coefficient": path["friction_coefficient"],
            "normal_stress_ratio": path["normal_stress_ratio"],
            "log10_slip_rate": path["log10_slip_rate"],
        }

    def _departure(self, scene: Scene, record: _Record) -> float:
        """Largest departure of friction, from `fit_from` on, from what a stiff slider shows after
        so much slip, ``b relaxation(-(alpha/b) ln r, slip)``; NaN where there is no such form.
        """
        law, coupling = scene.parts.law, scene.parts.normal_stress.coupling
        if law.relaxation is None or law.feels_stress or coupling is None:
            return math.nan
        slip = record.rows[:, OBSERVED.index("slip")]
        read = slip >= self.fit_from
        ratio = 1.0 + scene.parts.loading.segments[0].normal_stress
        # without b there is no alpha either, and nothing evolves
        away = -coupling[1] / scene.b * math.log(ratio) if scene.b else 0.0
        left = np.array([law.relaxation(away, at) for at in slip[read].tolist()])
        seen = friction_coefficient_of(record.rows[read]) - scene.mu_star
        return float(np.abs(seen - scene.b * left).max())


def _direct(scene: Scene, record: _Record) -> float:
    """Compute the immediate change of friction without the direct effect."""
    point = record.begin.point
    return point.coefficient - scene.mu_star - scene.a * point.log_slip_rate
