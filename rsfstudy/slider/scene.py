"""The Scene: which slider. Law, effects, parameters and loading, checked when it is made."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from numbers import Real
from typing import Any

from rsfstudy.errors import InvalidValue
from rsfstudy.slider import laws, loading, steady_state
from rsfstudy.slider.effects.inertia import inertial_time

NORMAL_STRESSES = ("constant", "variable")
_DEFAULT_ALPHA = 0.56
_DEFAULT_PHI = 60.0


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A spring-slider with rate- and state-dependent friction, sliding steadily at V_* until a step
    is imposed.

    Immutable and checked: a scene that exists is meaningful. Quantities are dimensionless, with
    stress in sigma_*, slip in D_c, time in D_c/V_* and slip rate in V_*.

    Parameters
    ----------
    law : {"slip", "slowness"}
        State evolution law; any module of `rsfstudy.slider.laws`.
    normal_stress : {"constant", "variable"}
        Constant, or coupled to shear stress by a driving stress inclined at `phi`.
    alpha : float, optional
        Strength of the normal stress effect on the state variable (variable normal stress only;
        0.56). Zero leaves the effect out.
    phi : float, optional
        Angle in degrees between the driving stress and the fault normal (variable normal stress
        only; 60).
    a, b_over_a : float
        Direct effect, and evolution effect over direct effect; b > a, rate weakening.
    mu_star : float
        Steady-state friction coefficient at V_*.
    stiffness_ratio : float
        Stiffness over the critical stiffness at V_*.
    load_velocity_ratio : float, optional
        Load point velocity over V_* after the step. Default: 1, or 0 after a displacement step.
    displacement_step : float
        Instantaneous displacement of the load point in D_c.
    inertia : bool
        Whether the slider has mass.
    radiation_damping : float
        eta V_*/sigma_*: stress that waves carry away at V_* (quasi-dynamic motion, instead of
        mass). Zero leaves the effect out; T V_*/(2 pi D_c) times the stiffness is the impedance of
        spring and mass.
    period : float
        Period of free oscillation T in s; with `reference_rate` it sets inertia and the instability
        norm.
    reference_rate : float
        V_*/D_c in 1/s.
    instability_norm : float
        A motion counts as unstable once V T/(2 pi D_c) reaches this norm.

    Raises
    ------
    InvalidValue
        For a value that is wrong or means nothing, with the rule it breaks and the remedy.
    """

    law: str = "slip"
    normal_stress: str = "variable"
    alpha: float | None = None
    phi: float | None = None
    a: float = 0.0145
    b_over_a: float = 2.0
    mu_star: float = 0.76
    stiffness_ratio: float = 1.0
    load_velocity_ratio: float | None = None
    displacement_step: float = 0.0
    inertia: bool = False
    radiation_damping: float = 0.0
    period: float = 5.0
    reference_rate: float = 1.17e-8
    instability_norm: float = 5e-4

    def __new__(cls, **fields: Any) -> Scene:
        """A scene to be filled in, unless a name is no field of one."""
        for name in fields:
            if name not in cls.__dataclass_fields__:
                raise unknown_field(name)
        return super().__new__(cls)

    def __post_init__(self) -> None:
        _check_choice("law", self.law, laws.NAMES)
        _check_choice("normal_stress", self.normal_stress, NORMAL_STRESSES)
        if not _is_flag(self.inertia):
            raise InvalidValue("inertia", self.inertia, "must be true or false")
        object.__setattr__(self, "inertia", bool(self.inertia))
        for name in ("a", "b_over_a", "mu_star", "stiffness_ratio", "period", "reference_rate"):
            self._set_number(name, positive=True)
        self._set_number("instability_norm", positive=True)
        self._set_number("displacement_step")
        self._set_number("radiation_damping")
        if self.load_velocity_ratio is not None:
            self._set_number("load_velocity_ratio")
        self._check_effects()
        self._check_meaning()

    def _set_number(self, name: str, *, positive: bool = False) -> None:
        value = getattr(self, name)
        if isinstance(value, bool) or not isinstance(value, Real):
            raise InvalidValue(name, value, "must be a number")
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise InvalidValue(name, number, "must be finite")
        if positive and number <= 0.0:
            raise InvalidValue(name, number, "must be greater than 0")
        object.__setattr__(self, name, number)

    def _check_effects(self) -> None:
        if self.normal_stress == "constant":
            for name in ("alpha", "phi"):
                value = getattr(self, name)
                if value is not None:
                    raise InvalidValue(
                        name,
                        value,
                        "has no meaning while normal stress is constant",
                        remedy=f"Leave {name} out, or set normal_stress='variable'.",
                    )
            return
        if self.alpha is None:
            object.__setattr__(self, "alpha", _DEFAULT_ALPHA)
        if self.phi is None:
            object.__setattr__(self, "phi", _DEFAULT_PHI)
        self._set_number("alpha")
        self._set_number("phi", positive=True)
        assert self.alpha is not None
        assert self.phi is not None
        if self.alpha < 0.0:
            raise InvalidValue("alpha", self.alpha, "must be 0 or greater")
        if self.phi >= 90.0:
            raise InvalidValue(
                "phi",
                self.phi,
                "must lie between 0 and 90 degrees",
                remedy="At 90 degrees it no longer varies: set normal_stress='constant'.",
            )
        lowest = math.degrees(math.atan(self.mu_star))
        if self.phi <= lowest:
            raise InvalidValue(
                "phi",
                self.phi,
                f"must exceed atan(mu_star) = {lowest:.6g} degrees: sigma_3 is negative below",
                remedy="Raise phi or lower mu_star.",
            )

    def _check_meaning(self) -> None:
        if self.radiation_damping < 0.0:
            raise InvalidValue("radiation_damping", self.radiation_damping, "must be 0 or greater")
        if self.radiation_damping > 0.0 and self.inertia:
            raise InvalidValue(
                "radiation_damping",
                self.radiation_damping,
                "stands in for mass, and this scene has mass",
                remedy="Leave one of them out.",
            )
        if self.b_over_a <= 1.0:
            raise InvalidValue(
                "b_over_a",
                self.b_over_a,
                "must exceed 1: without rate weakening there is no critical stiffness",
                remedy="Steady sliding is then stable at every stiffness.",
            )
        if self.load_velocity_ratio is not None and self.load_velocity_ratio < 0.0:
            raise InvalidValue(
                "load_velocity_ratio",
                self.load_velocity_ratio,
                "must be 0 or greater",
                remedy="0 holds the load point.",
            )

    # ---- what follows from the parameters -------------------------------------------------------

    @property
    def b(self) -> float:
        """Evolution effect parameter."""
        return self.a * self.b_over_a

    @property
    def cot_phi(self) -> float:
        """d sigma/d tau: cot(phi), and 0 at constant normal stress."""
        return 0.0 if self.phi is None else 1.0 / math.tan(math.radians(self.phi))

    @property
    def critical_stiffness(self) -> float:
        """k_cr(V_*) D_c/sigma_* (see `steady_state.critical_stiffness`)."""
        return steady_state.critical_stiffness(
            0.0, self.mu_star, self.a, self.b, self.cot_phi, self.alpha or 0.0
        )

    @property
    def stiffness(self) -> float:
        """K = k D_c/sigma_*."""
        return self.stiffness_ratio * self.critical_stiffness

    @property
    def load_velocity(self) -> float:
        """V_0/V_* after the step."""
        return loading.load_velocity(self.load_velocity_ratio, self.displacement_step)

    @property
    def log_load_rate(self) -> float:
        """ln(V_0/V_*), and -inf for a load point at rest."""
        return math.log(self.load_velocity) if self.load_velocity > 0.0 else -math.inf

    @property
    def spring_stress_step(self) -> float:
        """Change of spring stress over sigma_* by the displacement step."""
        return loading.spring_stress_step(self.displacement_step, self.stiffness)

    @property
    def inertial_time(self) -> float:
        """T V_*/(2 pi D_c)."""
        return inertial_time(self.period, self.reference_rate)

    @property
    def log_norm_rate(self) -> float:
        """ln(V/V_*) at which the instability norm is reached."""
        return math.log(self.instability_norm / self.inertial_time)

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that act in this scene."""
        present = {
            "inclined_driving": self.normal_stress == "variable",
            "linker_dieterich": bool(self.alpha),
            "inertia": self.inertia,
            "radiation_damping": self.radiation_damping > 0.0,
        }
        return tuple(name for name, acts in present.items() if acts)

    def with_(self, **changes: Any) -> Scene:
        """A copy with some fields changed, checked anew.

        Changing to constant normal stress drops `alpha` and `phi`.
        """
        unknown = set(changes) - set(FIELDS)
        if unknown:
            raise unknown_field(sorted(unknown)[0])
        if changes.get("normal_stress") == "constant":
            changes = {"alpha": None, "phi": None} | changes
        return replace(self, **changes)

    def as_dict(self) -> dict[str, Any]:
        """The fields as plain Python values."""
        return {name: getattr(self, name) for name in FIELDS}


FIELDS: tuple[str, ...] = tuple(field.name for field in fields(Scene))


def unknown_field(name: str) -> InvalidValue:
    """The error for a name that is no field of a scene."""
    return InvalidValue("field", name, "is not a field of a scene", choices=FIELDS)


def _is_flag(value: object) -> bool:
    return isinstance(value, bool) or type(value).__name__ == "bool"  # numpy's bool too


def _check_choice(name: str, value: object, choices: tuple[str, ...]) -> None:
    if not isinstance(value, str) or value not in choices:
        raise InvalidValue(name, value, "is unknown", choices=choices)
