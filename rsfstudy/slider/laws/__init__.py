"""State evolution laws, one file each.

The state variable is written so that every law shares

    tau = sigma (mu_* + a ln(V/V_*) + Theta),

which for the slowness law means Theta = b ln(theta/theta_*). Friction is mu_* at V_* by any law:
the state variable is measured from its value in steady sliding at V_*.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from rsfstudy._deprecation import renamed_members, renamed_names
from rsfstudy.slider.parts import (
    NON_NEGATIVE,
    POSITIVE,
    Function,
    Numbers,
    Part,
    discover_parts,
    flag,
    number,
)
from rsfstudy.slider.requirements import LAW_QUANTITIES
from rsfstudy.slider.scene_view import SceneView

#: Exponents of evolution laws beyond this occur in trial steps only, which the integrator rejects:
#: the equations of motion stop at slip rates of 10^-290 V_*.
LARGEST_EXPONENT = 700.0


def fast_expm1(exponent: float) -> float:
    """exp(x) - 1 to all digits, in a third of the time of `expm1` where x is far from 0."""
    return math.expm1(exponent) if abs(exponent) < 0.5 else math.exp(exponent) - 1.0


def cutoff_velocity_field() -> Any:
    """The field that laws with a slip rate of their own have in common."""
    return number(
        100.0,
        "$V_c/V_*$",
        "1",
        "cut-off velocity of the evolution effect",
        rule=POSITIVE,
        remedy="For a law without a cut-off, set law.",
    )


@renamed_members
@dataclass(frozen=True, kw_only=True)
class LawBase(Part):
    """Base class of all state evolution laws.

    Laws with a single b are derived from ``Law``, which is a subclass of this class.

    The functions of a law receive ln(V/V_*), the state variables and the parameters of the law. The
    friction coefficient of forward slip, ``tau/sigma = mu_* + a ln(V/V_*) + sum of Theta_i``, can
    be computed from these arguments. The functions do not receive shear stress, normal stress or
    pore pressure. If the state evolution depends on one of these quantities, list the quantity in
    ``needs``, for example ``needs = {"shear_stress"}``. The law is then rejected in scenes with
    variable effective normal stress. If effective normal stress is constant, shear stress divided
    by sigma_* equals the friction coefficient.

    A law with one state defines ``evolution(log_slip_rate, state, p)``. The function returns the
    change of the state variable per unit slip in D_c at constant normal stress. The steady state is
    ``Theta = -b ln(V/V_*)`` unless the law also defines ``steady_states(log_slip_rate, shift, p)``,
    which returns the states Psi in steady sliding. The argument ``shift`` is the amount by which
    stress has lowered the state variable. At V_* the states must add up to zero, because friction
    is mu_* there. A scene rejects a law whose evolution does not vanish at its steady states.

    A law with several states sets their number, for example ``states = 3``. Such a law must define
    ``steady_states`` and ``evolutions(log_slip_rate, psis, shift, fraction, p)``. The latter
    function returns a tuple with the change of each state, multiplied by ``fraction``, which is the
    ratio of slip to the clock of the integration. Both functions distribute the shift among the
    states, and the parts must add up to the whole shift. The field or property ``b_over_a`` is the
    evolution effect of all states together, divided by a. See ``two_slip_states`` for an example.

    Any unknown that affects friction, such as temperature, can be modelled as a state. Its value
    must be expressed as a contribution to the friction coefficient.
    """

    stress_dependence: float = number(
        0.0,
        "$c$",
        "1",
        "effect of shear stress on the state variable",
        rule=NON_NEGATIVE,
        remedy="Zero leaves the effect out.",
    )
    regularised: bool = flag(False, "whether slip may reverse, with the sign of shear stress")

    derived_properties = ("has_closed_orbits", "scale_free", "relaxation")
    defining_methods = frozenset({"evolution", "evolutions"})
    received_quantities = LAW_QUANTITIES
    #: How many states the law has.
    state_count: ClassVar[int] = 1
    #: Whether every orbit closes at critical stiffness, where friction alone acts and stress has no
    #: effect on it: where evolution changes with its own state in proportion to itself.
    has_closed_orbits: ClassVar[bool] = False
    #: Whether the state is ``Theta = b ln(theta/theta_*)``, so that there is a theta to tell of.
    has_logarithmic_state: ClassVar[bool] = True
    #: Whether the law has no slip rate of its own, so that V_* could be any other.
    scale_free: ClassVar[bool] = False
    #: ``relaxation(rate, slip)``: the stress in units of b that is left above its steady value
    #: after so much slip at constant ln(V/V_*), at constant normal stress; closed forms only. A
    #: method where it draws on numbers of the law.
    relaxation: ClassVar[Function | None] = None
    evolution: ClassVar[Function | None] = None
    evolutions: ClassVar[Function | None] = None
    steady_states: ClassVar[Function | None] = None
    #: ``state_effect(friction, ratio, change, p) -> (shift, slope)``: by how much stress lowers the
    #: state variable, and its derivative with respect to friction; none for most laws.
    state_effect: ClassVar[Function | None] = None

    @classmethod
    def required_functions(cls) -> tuple[str, ...]:
        return ("evolution",) if cls.state_count == 1 else ("evolutions", "steady_states")

    @property
    def b_over_a(self) -> float:
        """Evolution effect of all states together, over the direct effect."""
        raise TypeError(f"{type(self).__name__} states no b_over_a")

    def numbers(self, scene: SceneView) -> Numbers:
        """Return the parameters that precede the fields of a law.

        The base class has no such parameters.
        """
        return ()

    @property
    def state_change_over_a(self) -> float:
        """Change of the states by a unit of ln V, over the direct effect; positive."""
        return abs(self.b_over_a) or VANISHING_B_OVER_A

    @property
    def depends_on_stress(self) -> bool:
        """True if stress itself changes the state variable."""
        return self.state_effect is not None or self.stress_dependence > 0.0

    @property
    def effects(self) -> tuple[str, ...]:
        named = {"stress_dependence": self.stress_dependence, "regularised": self.regularised}
        return tuple(name for name, acts in named.items() if acts)

    def check(self, scene: SceneView) -> None:
        """Normal stress of which the integral of ``dtau/sigma`` is known, and motion that may
        reverse, where that matters.
        """
        stress, fluid = scene.parts.normal_stress, scene.parts.fluid
        loading, source = scene.parts.loading, scene.pressure_source
        bends = stress.normal_stress is not None and not stress.coupling
        unknown = fluid.name if fluid.unknowns else stress.name if bends else ""
        if not unknown and loading.changes_normal_stress:
            unknown = "normal stress that the loading changes"
        if self.stress_dependence and unknown:
            rule = f"is known for normal stress in proportion to shear stress, not for {unknown}"
            remedy = "Leave it out, or state `coupling` where the proportion is constant."
            raise self.field_error("stress_dependence", rule, remedy)
        pressed = source.unknowns and not loading.has_load_point_unknown
        one_way = (
            source if pressed else None if scene.dynamics.allows_reversed_slip else scene.dynamics
        )
        if self.regularised and one_way:
            rule = f"has no meaning for {one_way.name}, whose equations hold ln V"
            raise self.field_error("regularised", rule, "Leave one of them out.")


@renamed_members
@dataclass(frozen=True, kw_only=True)
class Law(LawBase):
    """Base class of the laws with a single b.

    A law is defined by a plain function of floats, which is stored in the class as
    ``evolution = staticmethod(evolution)``::

        evolution(log_slip_rate, state, p) -> float

    The function returns the change of Theta per unit slip in D_c at constant normal stress. The
    argument ``log_slip_rate`` is ln(V/V_*), and ``state`` is Theta. The element ``p[LAW]`` is b
    (``rsfstudy.slider.parameter_layout.LAW``). Declare the parameters of the law as fields, with
    ``rsfstudy.slider.parts.number``. The parameters follow b in the order of their declaration, as
    ``p[LAW + 1]``, ``p[LAW + 2]`` and so on. Two methods are optional::

        numbers(self, scene) -> tuple[float, ...]
        check(self, scene) -> None

    Override ``numbers`` if ``evolution`` uses values other than the fields, such as logarithms of
    the fields. The method must return ``(*super().numbers(scene), ...)``. Override ``check`` to
    raise ``InvalidValue`` if field values contradict each other. The class attribute ``name`` is
    the name of the law. The attributes ``relaxation``, ``steady_states`` and ``state_effect`` are
    optional as well. A law with one b can have several states. Such a law defines ``evolutions``
    and ``steady_states``, as described for ``LawBase``.
    """

    b_over_a: float = number(2.0, "$b/a$", "1", "ratio of evolution effect to direct effect")

    def numbers(self, scene: SceneView) -> Numbers:
        """b; of no effect at all, one that nothing feels, because equations divide by it."""
        return (scene.a * (self.b_over_a or VANISHING_B_OVER_A),)

    @property
    def min_weakening_b_over_a(self) -> float:
        """Smallest b/a for steady friction to fall with slip rate at V_*."""
        return 1.0

    def check(self, scene: SceneView) -> None:
        """A critical stiffness, where the spring is given by its ratio to it; rate weakening is
        enough.
        """
        super().check(scene)
        if not self.b_over_a and (self.depends_on_stress or scene.parts.normal_stress.state_effect):
            rule = "has no meaning where stress acts on the state variable: by alpha/b or c/b"
            remedy = "Leave alpha and stress_dependence out, or give another b_over_a."
            raise self.field_error("b_over_a", rule, remedy)
        if not self.b_over_a and scene.parts.slider.initial_state:
            rule = "is of a state variable that has no effect where b_over_a is 0"
            raise scene.parts.slider.field_error("initial_state", rule, "Leave initial_state out.")
        if 0.0 < abs(self.b_over_a) < MIN_B_OVER_A:
            raise self.field_error(
                "b_over_a", f"must be 0, or at least {MIN_B_OVER_A:g} in size", "Give 0."
            )
        least = self.min_weakening_b_over_a
        if self.b_over_a <= least and lacks_critical_stiffness(scene):
            rule = f"must exceed {least:.6g}: without rate weakening there is no critical stiffness"
            raise self.field_error("b_over_a", rule, STIFFNESS_REMEDY)


#: b/a in equations that divide by b, of a state variable without effect: by far less than rounding.
VANISHING_B_OVER_A = 1e-60
#: The smallest b/a but 0: below it, powers and quotients of it are lost to the range of numbers.
MIN_B_OVER_A = 1e-30
#: What to do where there is no critical stiffness.
STIFFNESS_REMEDY = "Sliding is then stable at every stiffness, or at none: give stiffness itself."


def lacks_critical_stiffness(scene: SceneView) -> bool:
    """True if the spring is given by its ratio to a critical stiffness that there is not: stable or
    unstable is then every spring.
    """
    stated = scene.parts.slider.stiffness is not None
    return not stated and not 0.0 < scene.critical_stiffness < math.inf


BUILT_IN_PARTS = discover_parts(__name__, __path__)

if not TYPE_CHECKING:
    __getattr__ = renamed_names(__name__)
