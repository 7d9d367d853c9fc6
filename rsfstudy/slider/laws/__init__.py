r"""State evolution laws of rate- and state-dependent friction.

Each module of this package defines one law. The function ``discover_parts`` finds the modules
automatically, so a new law does not have to be registered. Modules with a leading underscore
contain code that several laws share. In all laws, the state variable :math:`\Theta` is a
contribution to the friction coefficient:

.. math::

    \tau = \sigma \left(\mu_* + a \ln \frac{V}{V_*} + \Theta\right).

For the slowness law, :math:`\Theta = b \ln(\theta/\theta_*)`. Every law sets :math:`\Theta = 0` in
steady sliding at the reference velocity :math:`V_*`, so the friction coefficient there is
:math:`\mu_*`. The base classes are ``LawBase`` and ``Law``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from rsfstudy._deprecation import add_former_member_names, build_getattr_for_former_names
from rsfstudy.errors import InvalidValue
from rsfstudy.slider.parts import (
    NON_NEGATIVE,
    POSITIVE,
    FloatTuple,
    NumericFunction,
    Part,
    discover_parts,
    flag,
    number,
)
from rsfstudy.slider.quantities_required_by_parts import QUANTITIES_RECEIVED_BY_LAWS
from rsfstudy.slider.scene_view import SceneView

#: Upper limit of exponents in evolution laws. A larger exponent occurs only in a trial step that
#: the integrator rejects. Motions end before their slip rate falls below 10^-290 V_*.
MAX_EXPONENT_IN_STATE_EVOLUTION = 700.0


def fast_expm1(exponent: float) -> float:
    """Compute exp(x) - 1 to full precision, faster than ``math.expm1``.

    For arguments that are not close to zero, the function subtracts 1 from ``math.exp(x)``. This
    takes a third of the time of ``math.expm1``.

    Parameters
    ----------
    exponent : float
        Exponent x.

    Returns
    -------
    float
        Value of exp(x) - 1.
    """
    return math.expm1(exponent) if abs(exponent) < 0.5 else math.exp(exponent) - 1.0


def declare_cutoff_velocity_field() -> Any:
    """Declare the field ``cutoff_velocity_ratio`` of laws with a cut-off velocity.

    Returns
    -------
    dataclasses.Field
        Field for a dataclass, with a default of 100.
    """
    return number(
        100.0,
        "$V_c/V_*$",
        "1",
        "cut-off velocity of the evolution effect",
        rule=POSITIVE,
        remedy="For state evolution without a cut-off velocity, choose a law other than "
        "'cut_off' or 'composite'.",
    )


@add_former_member_names
@dataclass(frozen=True, kw_only=True)
class LawBase(Part):
    r"""Base class of all state evolution laws.

    Laws with a single parameter b are derived from ``Law``, which is a subclass of this class.

    The functions of a law receive :math:`\ln(V/V_*)`, the state variables and the parameters of the
    law. From these arguments, a function can compute the friction coefficient for forward slip,
    :math:`\tau/\sigma = \mu_* + a \ln(V/V_*) + \sum_i \Theta_i`. The functions do not receive shear
    stress, normal stress or pore pressure. If the state evolution depends on one of these
    quantities, list the quantity in ``needs``, for example ``needs = {"shear_stress"}``. A scene
    rejects the law if a quantity in ``needs`` is unknown, for example because effective normal
    stress varies. If effective normal stress is constant, shear stress divided by :math:`\sigma_*`
    equals the friction coefficient.

    The arguments of the functions have the same meaning for all laws: ``log_slip_rate`` is
    :math:`\ln(V/V_*)`, ``state`` is the state variable :math:`\Theta`, ``psis`` is the tuple of
    states :math:`\Psi_i`, which exclude the effect of stress, and ``p`` is the tuple of parameters,
    in which the parameters of the law start at ``p[LAW]``.

    A law with one state defines ``evolution(log_slip_rate, state, p)``. The function returns the
    change in the state variable per unit slip in :math:`D_c` at constant normal stress. The default
    steady state is :math:`\Theta = -b \ln(V/V_*)`. If the steady state of a law differs from the
    default, the law also defines ``steady_states(log_slip_rate, shift, p)``, which returns the
    states :math:`\Psi` in steady sliding. The argument ``shift`` is the stress-induced decrease in
    the state variable. In steady sliding at :math:`V_*`, the state variables must add up to zero,
    because the friction coefficient is :math:`\mu_*`. A scene rejects a law if the states are not
    constant in steady sliding.

    A law with several states sets the attribute ``state_count``, for example ``state_count = 3``. A
    law with several states must also define ``steady_states`` and ``evolutions(log_slip_rate, psis,
    shift, fraction, p)``. The function ``evolutions`` returns a tuple with the change of each state
    per unit slip, multiplied by ``fraction``. The argument ``fraction`` is the slip per unit of the
    independent variable of the integration. The functions ``evolutions`` and ``steady_states``
    must distribute the stress-induced decrease ``shift`` among the states. The sum of the decreases
    of all states must equal ``shift``. The field or property ``b_over_a`` is the total evolution
    effect of all states, divided by the direct effect a. See the module ``two_slip_states`` for an
    example.

    Any unknown that affects friction, such as temperature, can be modelled as a state. The value of
    the state must be expressed as a contribution to the friction coefficient.

    Parameters
    ----------
    stress_dependence : float, default: 0.0
        Effect :math:`c` of shear stress on the state variable. A change :math:`d\tau` of shear
        stress decreases the state variable by :math:`c \, d\tau/\sigma`. Zero disables the effect.
    regularised : bool, default: False
        If True, the regularised friction law is used, in which slip reverses when the shear stress
        changes sign.

    References
    ----------
    Nagata, Nakatani and Yoshida (2012), J. Geophys. Res. 117, B02314.

    Examples
    --------
    >>> from rsfstudy.parts import LawBase
    >>> from rsfstudy.slider.laws.two_slip_states import TwoStateSlipLaw
    >>> issubclass(TwoStateSlipLaw, LawBase)
    True
    >>> law = TwoStateSlipLaw(b1_over_a=1.0, b2_over_a=0.5)
    >>> law.state_count, law.b_over_a
    (2, 1.5)
    """

    stress_dependence: float = number(
        0.0,
        "$c$",
        "1",
        "effect of shear stress on the state variable",
        rule=NON_NEGATIVE,
        remedy="With the value 0, shear stress does not affect the state variable.",
    )
    regularised: bool = flag(
        False, "1 if slip can reverse with the sign of the shear stress, otherwise 0"
    )

    members_derived_from_equations = (
        "has_closed_orbits_at_critical_stiffness",
        "lacks_characteristic_slip_rate",
        "state_relaxation_function",
    )
    members_defining_equations = frozenset({"evolution", "evolutions"})
    received_quantity_names = QUANTITIES_RECEIVED_BY_LAWS
    #: Number of states of the law.
    state_count: ClassVar[int] = 1
    #: True if every orbit around steady sliding is closed at the critical stiffness, provided that
    #: the motion is quasi-static and stress does not affect the state. Set this attribute to True
    #: only if the derivative of the evolution with respect to the state is a linear function of the
    #: evolution.
    has_closed_orbits_at_critical_stiffness: ClassVar[bool] = False
    #: True if Theta = b ln(theta/theta_*), so that theta can be computed from the state variable.
    has_logarithmic_state: ClassVar[bool] = True
    #: True if the law contains no characteristic slip rate, so the choice of V_* is arbitrary.
    lacks_characteristic_slip_rate: ClassVar[bool] = False
    #: Function ``state_relaxation_function(rate, slip)``, the closed-form solution at constant
    #: normal stress and constant slip rate. The argument ``rate`` is ln(V/V_*), and ``slip`` is the
    #: slip in D_c. The function returns the difference between the friction coefficient and its
    #: steady value, divided by b. If the function uses fields of the law,
    #: ``state_relaxation_function`` is a method.
    state_relaxation_function: ClassVar[NumericFunction | None] = None
    evolution: ClassVar[NumericFunction | None] = None
    evolutions: ClassVar[NumericFunction | None] = None
    steady_states: ClassVar[NumericFunction | None] = None
    #: Function ``state_effect(friction, ratio, change, p) -> (shift, slope)``. The value ``shift``
    #: is the decrease in the state variable due to stress. The value ``slope`` is the derivative of
    #: ``shift`` with respect to frictional stress. Most laws do not define ``state_effect``.
    state_effect: ClassVar[NumericFunction | None] = None

    @classmethod
    def list_required_function_names(cls) -> tuple[str, ...]:
        """Return the names of the functions that the law must define.

        Returns
        -------
        tuple of str
            ``("evolution",)`` for a law with one state, and ``("evolutions", "steady_states")`` for
            a law with several states.
        """
        return ("evolution",) if cls.state_count == 1 else ("evolutions", "steady_states")

    @property
    def b_over_a(self) -> float:
        """Ratio of the total evolution effect to the direct effect.

        Subclasses must override ``b_over_a`` as a property or as a field.
        """
        raise TypeError(f"{type(self).__name__} does not define b_over_a")

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        """Return the parameters that precede the fields of the law in the tuple ``p``.

        The base class returns an empty tuple.

        Parameters
        ----------
        scene : Scene
            Scene that the law belongs to.

        Returns
        -------
        tuple of float
            Values for ``p[LAW]`` and the following elements.
        """
        return ()

    @property
    def steady_state_change_per_log_rate_over_a(self) -> float:
        """Magnitude of the change in the steady state per unit change in ln V, divided by a.

        The value is always positive.
        """
        return abs(self.b_over_a) or B_OVER_A_USED_INSTEAD_OF_ZERO

    @property
    def depends_on_stress(self) -> bool:
        """True if stress directly changes the state variable."""
        return self.state_effect is not None or self.stress_dependence > 0.0

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the active optional effects of the law."""
        named = {"stress_dependence": self.stress_dependence, "regularised": self.regularised}
        return tuple(name for name, acts in named.items() if acts)

    @classmethod
    def build_field_rejection_error(cls, field_name: str, value: object) -> InvalidValue:
        """Return the error for a field that belongs to another law.

        Parameters
        ----------
        field_name : str
            Name of the field.
        value : object
            Value of the field.

        Returns
        -------
        InvalidValue
            Error whose message contains the name of this law.
        """
        rule = f"does not apply to law={cls.name!r}"
        return InvalidValue(field_name, value, rule, remedy=f"Omit {field_name}.")

    def check(self, scene: SceneView) -> None:
        r"""Check that the scene supports the stress effect and reversed slip.

        The effect of shear stress can be computed only if the integral of :math:`d\tau/\sigma` is
        known. Normal stress must therefore be constant or a linear function of shear stress.
        Reversed slip requires dynamics that allow a negative slip rate.

        Parameters
        ----------
        scene : Scene
            Scene that the law belongs to.

        Raises
        ------
        InvalidValue
            If ``stress_dependence`` or ``regularised`` is incompatible with another part of the
            scene.
        """
        stress, fluid = scene.parts.normal_stress, scene.parts.fluid
        loading, source = scene.parts.loading, scene.part_changing_effective_stress
        bends = stress.normal_stress is not None and not stress.coupling
        unknown = f"normal_stress={stress.name!r}" if bends else ""
        if fluid.unknowns:
            unknown = f"fluid={fluid.name!r}"
        if not unknown and scene.changes_normal_stress:
            unknown = "a loading that changes normal stress"
        if self.stress_dependence and unknown:
            rule = (
                "can only be used if the normal stress is proportional to the shear stress, which "
                f"is not the case for {unknown}"
            )
            remedy = (
                "Omit stress_dependence. If you use your own normal stress class, and the ratio of "
                "normal stress to shear stress is constant, define the property 'coupling' in that "
                "class."
            )
            raise self.build_field_error("stress_dependence", rule, remedy)
        pressed = source.unknowns and not loading.adds_load_point_displacement_unknown
        slot_name = "fluid" if source is fluid else "loading"
        if scene.parts.temperature.unknowns:
            pressed, source, slot_name = True, scene.parts.temperature, "temperature"
        one_way = (
            source if pressed else None if scene.dynamics.allows_reversed_slip else scene.dynamics
        )
        if self.regularised and one_way:
            selector = one_way.field_name_that_selects_part
            other = (
                f"{selector}={getattr(one_way, selector)!r}"
                if selector
                else f"{slot_name if pressed else 'dynamics'}={one_way.name!r}"
            )
            rule = (
                f"cannot be combined with {other}, because the corresponding equations contain "
                "ln V and are therefore valid for forward slip only"
            )
            raise self.build_field_error("regularised", rule, "Omit one of the two.")


@add_former_member_names
@dataclass(frozen=True, kw_only=True)
class Law(LawBase):
    r"""Base class of the laws with a single evolution effect parameter b.

    A law is defined by a plain function of floats, which is stored in the class as ``evolution =
    staticmethod(evolution)``::

        evolution(log_slip_rate, state, p) -> float

    The function returns the change in :math:`\Theta` per unit slip in :math:`D_c` at constant
    normal stress. See ``LawBase`` for a description of the arguments. The element ``p[LAW]`` is b,
    where the constant ``LAW`` can be imported from ``rsfstudy.parts``. Declare the parameters of
    the law as fields with ``rsfstudy.parts.number``. In the tuple ``p``, these parameters follow b
    in the order of their declaration, as ``p[LAW + 1]``, ``p[LAW + 2]`` and so on. Two methods are
    optional::

        parameter_values(self, scene) -> tuple[float, ...]
        check(self, scene) -> None

    Override the ``parameter_values`` method if the ``evolution`` function uses values that are
    derived from the fields, such as logarithms of the fields. The overriding method must return
    ``(*super().parameter_values(scene), ...)``. Override the ``check`` method to raise
    ``InvalidValue`` if field values contradict each other. The ``name`` class attribute contains
    the name of the law. The attributes ``relaxation``, ``steady_states`` and ``state_effect`` are
    also optional. A law with one parameter b can have several states. To define such a law,
    implement the functions ``evolutions`` and ``steady_states`` as described for ``LawBase``.

    Parameters
    ----------
    stress_dependence : float, default: 0.0
        Effect :math:`c` of shear stress on the state variable (see ``LawBase``).
    regularised : bool, default: False
        If True, slip reverses when the shear stress changes sign.
    b_over_a : float, default: 2.0
        Ratio :math:`b/a` of the evolution effect to the direct effect.

    Examples
    --------
    Define a law that is symmetric about steady sliding:

    >>> import math
    >>> from dataclasses import dataclass
    >>> from rsfstudy import Scene
    >>> from rsfstudy.parts import LAW, Law
    >>> def evolution(log_slip_rate, state, p):
    ...     return -p[LAW] * math.tanh(state / p[LAW] + log_slip_rate)
    >>> @dataclass(frozen=True, kw_only=True)
    ... class TanhLaw(Law):
    ...     name = "tanh_law"
    ...     evolution = staticmethod(evolution)
    >>> scene = Scene(law=TanhLaw, normal_stress="constant", a=0.01, b_over_a=1.5)
    >>> round(scene.critical_stiffness, 6)
    0.005
    """

    b_over_a: float = number(2.0, "$b/a$", "1", "ratio of evolution effect to direct effect")

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        """Return the parameters of the law. The first parameter is b.

        If ``b_over_a`` is zero, the method returns a negligible positive value, because equations
        divide by b.

        Parameters
        ----------
        scene : Scene
            Scene that the law belongs to.

        Returns
        -------
        tuple of float
            Evolution effect parameter b.
        """
        return (scene.a * (self.b_over_a or B_OVER_A_USED_INSTEAD_OF_ZERO),)

    @property
    def min_b_over_a_for_weakening(self) -> float:
        """Smallest b/a for which steady friction decreases with slip rate.

        The change in friction with slip rate is evaluated in steady sliding at :math:`V_*`.
        """
        return 1.0

    def check(self, scene: SceneView) -> None:
        """Check ``b_over_a`` against the other fields of the scene.

        If the stiffness is given relative to the critical stiffness, the friction must be rate
        weakening. If ``b_over_a`` is zero, the state variable has no effect. In this case, stress
        effects on the state and an initial state are rejected.

        Parameters
        ----------
        scene : Scene
            Scene that the law belongs to.

        Raises
        ------
        InvalidValue
            If ``b_over_a`` is incompatible with the scene.
        """
        super().check(scene)
        if not self.b_over_a and (self.depends_on_stress or scene.parts.normal_stress.state_effect):
            rule = (
                "cannot be used if stress acts on the state variable, because its effects are "
                "alpha/b and c/b"
            )
            remedy = "Omit alpha and stress_dependence, or pass another value of b_over_a."
            raise self.build_field_error("b_over_a", rule, remedy)
        if not self.b_over_a and scene.parts.slider_parameters.initial_state:
            rule = "has no effect, because b_over_a is 0"
            raise scene.parts.slider_parameters.build_field_error(
                "initial_state", rule, "Omit initial_state."
            )
        if 0.0 < abs(self.b_over_a) < MIN_NONZERO_B_OVER_A:
            raise self.build_field_error(
                "b_over_a",
                f"must be 0 or have an absolute value of at least {MIN_NONZERO_B_OVER_A:g}",
                "Pass 0.",
            )
        least = self.min_b_over_a_for_weakening
        if self.b_over_a <= least and lacks_critical_stiffness(scene):
            rule = (
                f"must exceed {least:.6g}, because only rate-weakening friction has a critical "
                "stiffness"
            )
            raise self.build_field_error("b_over_a", rule, MISSING_CRITICAL_STIFFNESS_REMEDY)


#: Value of b/a that is used instead of zero, because equations divide by b. The value is so small
#: that its effect is far smaller than rounding errors.
B_OVER_A_USED_INSTEAD_OF_ZERO = 1e-60
#: Smallest nonzero b/a. Powers and quotients of smaller values would underflow or overflow.
MIN_NONZERO_B_OVER_A = 1e-30
#: Advice to the user in error messages about a missing critical stiffness.
MISSING_CRITICAL_STIFFNESS_REMEDY = (
    "Pass stiffness instead of stiffness_ratio, which is relative to the critical stiffness."
)


def lacks_critical_stiffness(scene: SceneView) -> bool:
    """Return True if the stiffness ratio of a scene is undefined.

    The stiffness ratio is undefined if the critical stiffness is zero or infinite, because the
    stability of steady sliding is then the same at every stiffness.

    Parameters
    ----------
    scene : Scene
        Scene to examine.

    Returns
    -------
    bool
        True if the scene has no explicit stiffness and its critical stiffness is not a positive
        finite number.
    """
    stated = scene.parts.slider_parameters.stiffness is not None
    return not stated and not 0.0 < scene.critical_stiffness < math.inf


BUILT_IN_LAW_CLASS_BY_NAME = discover_parts(__name__, __path__)

if not TYPE_CHECKING:
    __getattr__ = build_getattr_for_former_names(__name__)
