"""Pore fluid that flows into or out of a dilating or compacting fault (Segall and Rice 1995).

If the dilatancy is positive, pores open when the slip rate increases. The pore pressure then falls
until fluid flows in from the surroundings. If the dilatancy is negative, pores close when the slip
rate increases, and the pore pressure rises.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.quantities import Quantity
from rsfstudy.slider.fluid import (
    PORE_PRESSURE_QUANTITY,
    Fluid,
    declare_dilatancy_field,
    declare_drainage_field,
    declare_porosity_length_field,
)
from rsfstudy.slider.laws import lacks_critical_stiffness
from rsfstudy.slider.parameter_layout import FLUID, LOG_SLOWNESS_UPPER_LIMIT
from rsfstudy.slider.parts import FloatTuple, NumericFunction
from rsfstudy.slider.scene_view import SceneView


def compute_porosity_and_pressure_rates(
    log_slip_rate: float, states: FloatTuple, slip_per_independent_variable: float, p: FloatTuple
) -> FloatTuple:
    r"""Compute the rates of porosity and pore pressure.

    The class ``Fluid`` describes the arguments. The states are the porosity
    :math:`(\varphi - \varphi_0)/(\beta \sigma_*)` and the pore pressure :math:`P`. The function
    reads the dilatancy :math:`\epsilon/(\beta \sigma_*)` from ``p[FLUID]`` and the drainage
    :math:`c^* D_c/V_*` from ``p[FLUID + 1]``.

    Notes
    -----
    With :math:`dt = d\delta/V`, the rates are

    .. math::

        D_c \frac{d\varphi}{d\delta}
          = -\left(\varphi - \varphi_0 - \epsilon \ln\frac{V}{V_*}\right), \quad
          \frac{dp}{dt} = c^* (p_\infty - p) - \frac{1}{\beta} \frac{d\varphi}{dt}.

    References
    ----------
    Segall and Rice (1995), J. Geophys. Res. 100, 22155-22171
    """
    porosity, pressure = states
    opening = slip_per_independent_variable * (p[FLUID] * log_slip_rate - porosity)
    time = slip_per_independent_variable * math.exp(min(-log_slip_rate, LOG_SLOWNESS_UPPER_LIMIT))
    return opening, -p[FLUID + 1] * time * pressure - opening


def compute_rates_with_porosity_length(
    log_slip_rate: float, states: FloatTuple, slip_per_independent_variable: float, p: FloatTuple
) -> FloatTuple:
    r"""Compute the rates of porosity and pore pressure if porosity has its own slip distance.

    Unlike ``compute_porosity_and_pressure_rates``, the function uses the slip distance
    :math:`L_\varphi` for the porosity. It reads :math:`D_c/L_\varphi` from ``p[FLUID + 2]``.

    Notes
    -----
    The rate of porosity is

    .. math::

        L_\varphi \frac{d\varphi}{d\delta}
          = -\left(\varphi - \varphi_0 - \epsilon \ln\frac{V}{V_*}\right).
    """
    porosity, pressure = states
    opening = slip_per_independent_variable * (p[FLUID] * log_slip_rate - porosity) * p[FLUID + 2]
    time = slip_per_independent_variable * math.exp(min(-log_slip_rate, LOG_SLOWNESS_UPPER_LIMIT))
    return opening, -p[FLUID + 1] * time * pressure - opening


def choose_porosity_rate_function(porosity_length: float) -> NumericFunction:
    """Return the function that computes the rates of porosity and pore pressure.

    Parameters
    ----------
    porosity_length : float
        Slip distance of the porosity in :math:`D_c`.

    Returns
    -------
    callable
        Function ``auxiliary_rates``. If the slip distance is :math:`D_c`, the function does not
        read the slip distance.
    """
    return (
        compute_porosity_and_pressure_rates
        if porosity_length == 1.0
        else compute_rates_with_porosity_length
    )


def check_porosity_length(fluid: Fluid, scene: SceneView) -> None:
    """Check that the scene supports the slip distance of the porosity.

    If a loading has unknowns, its parameters occupy elements of the parameter tuple that are
    otherwise used by the fluid. The tuple then has no free element for the slip distance of the
    porosity.

    Parameters
    ----------
    fluid : DilatantFluid or ThermalFluid
        Fluid of the scene.
    scene : Scene
        Scene that the fluid belongs to.

    Raises
    ------
    InvalidValue
        If the slip distance is not 1 but cannot be used, because the loading has unknowns or
        because a user-defined fluid defines its own rates.
    """
    if getattr(fluid, "porosity_length", 1.0) == 1.0:
        return
    loading, remedy = scene.parts.loading, "Omit porosity_length."
    if fluid.auxiliary_rates is not compute_rates_with_porosity_length:
        rule = f"has no effect on the rates of the fluid {fluid.name!r}"
        raise fluid.build_field_error("porosity_length", rule, remedy)
    if loading.unknowns:
        rule = f"must be 1 if the loading {loading.name!r} changes the pore pressure"
        raise fluid.build_field_error("porosity_length", rule, remedy)


def compute_steady_porosity_and_pressure(log_slip_rate: float, p: FloatTuple) -> FloatTuple:
    r"""Compute porosity and pore pressure in steady sliding.

    See ``Fluid`` for the arguments.

    Notes
    -----
    In steady sliding, the porosity is

    .. math::

        \varphi = \varphi_0 + \epsilon \ln\frac{V}{V_*}.
    """
    return p[FLUID] * log_slip_rate, 0.0


@dataclass(frozen=True, kw_only=True)
class DilatantFluid(Fluid):
    r"""Pore fluid of a dilatant fault that exchanges fluid with the surroundings.

    The pores open when the slip rate increases, which decreases the pore pressure. If the dilatancy
    is negative, the pores close when the slip rate increases, which increases the pore pressure.
    The initial pore pressure equals the pressure of the surroundings, as it does in steady sliding.

    Parameters
    ----------
    dilatancy : float, default: 0.01
        Dilatancy :math:`\epsilon/(\beta \sigma_*)`. Without drainage, an increase in :math:`\ln V`
        by 1 decreases the pore pressure by the dilatancy, in units of :math:`\sigma_*`. A negative
        value describes compaction.
    drainage : float, default: 1.0
        Drainage rate :math:`c^* D_c/V_*`.
    porosity_length : float, default: 1.0
        Slip distance :math:`L_\varphi/D_c` over which the porosity approaches its steady value. The
        slip distance of the friction law is :math:`D_c`.

    References
    ----------
    Segall and Rice (1995), J. Geophys. Res. 100, 22155-22171, and, for compaction with a separate
    slip distance, Gualandi et al. (2023), Earth Planet. Sci. Lett. 604, 117995.
    """

    dilatancy: float = declare_dilatancy_field(0.01)
    drainage: float = declare_drainage_field()
    porosity_length: float = declare_porosity_length_field()

    name = "dilatant"
    unknowns = (
        Quantity(
            "porosity",
            r"$(\varphi-\varphi_0)/(\beta\sigma_*)$",
            "1",
            "porosity minus the porosity in steady sliding at V_star",
            "beta sigma_*",
        ),
        PORE_PRESSURE_QUANTITY,
    )
    auxiliary_rates = staticmethod(compute_porosity_and_pressure_rates)
    auxiliary_steady_states = staticmethod(compute_steady_porosity_and_pressure)

    def __post_init__(self) -> None:
        """Select the porosity rate function, unless a subclass defines its own."""
        if (
            self.porosity_length != 1.0
            and self.auxiliary_rates is compute_porosity_and_pressure_rates
        ):
            object.__setattr__(self, "auxiliary_rates", compute_rates_with_porosity_length)

    def check(self, scene: SceneView) -> None:
        """Check the porosity length, and check that the stiffness ratio is defined.

        See ``Part.check``.
        """
        check_porosity_length(self, scene)
        if lacks_critical_stiffness(scene):
            rule = (
                "cannot be used with stiffness_ratio, because no critical stiffness exists for "
                f"this value and dilatancy = {self.dilatancy:g}"
            )
            raise self.build_field_error(
                "drainage", rule, "Pass stiffness instead of stiffness_ratio, or increase drainage."
            )

    def compute_pore_pressure_upper_bound(self, log_slip_rate: float, states: FloatTuple) -> float:
        r"""Compute an upper bound on the future pore pressure.

        See ``Fluid.compute_pore_pressure_upper_bound``. The upper bound follows from the drainage
        rate and from the largest rate at which pores can close. The closing rate is :math:`V
        (\varphi - \varphi_0 - \epsilon \ln(V/V_*)) D_c/L_\varphi`. If the dilatancy is negative,
        the porosity may first increase while slip is slow. The closing rate is then largest when
        the slip rate increases again. The upper bound therefore includes the steady porosity at the
        lowest slip rate.
        """
        closing = max(
            states[0] - self.dilatancy * log_slip_rate,
            self.dilatancy,
            -self.dilatancy * (LOG_SLOWNESS_UPPER_LIMIT + log_slip_rate),
        )
        closing_rate = math.exp(log_slip_rate) * closing / self.porosity_length
        return max(states[1], closing_rate / self.drainage)

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the active physical effects of the part."""
        return ("dilatancy",)

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        """Return the dilatancy and the drainage rate.

        See ``Part.parameter_values``. If the porosity length is not 1, its inverse is the third
        value.
        """
        plain = self.dilatancy, self.drainage
        if self.auxiliary_rates is not compute_rates_with_porosity_length:
            return plain
        return *plain, 1.0 / self.porosity_length
