"""Pore fluid that is pressurised by frictional heat in a fault that can dilate (Rice 2006).

When the fault heats up, the pore fluid expands more than the pore space. The pore pressure
therefore rises, and fluid flows out to the surroundings.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.errors import InvalidValue
from rsfstudy.quantities import Quantity
from rsfstudy.slider.fluid import (
    PORE_PRESSURE_QUANTITY,
    Fluid,
    declare_dilatancy_field,
    declare_drainage_field,
    declare_porosity_length_field,
)
from rsfstudy.slider.fluid.dilatant import (
    DilatantFluid,
    check_porosity_length,
    choose_porosity_rate_function,
    compute_steady_porosity_and_pressure,
)
from rsfstudy.slider.laws import lacks_critical_stiffness
from rsfstudy.slider.parameter_layout import FLUID, LOG_SLOWNESS_UPPER_LIMIT
from rsfstudy.slider.parts import NON_NEGATIVE, FloatTuple, NumericFunction, number
from rsfstudy.slider.scene_view import SceneView


def compute_drainage_pressure_rate(
    log_slip_rate: float, states: FloatTuple, slip_per_independent_variable: float, p: FloatTuple
) -> FloatTuple:
    r"""Compute the rate of the pore pressure due to drainage.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    states : tuple of float
        Pore pressure :math:`P`.
    slip_per_independent_variable : float
        Slip per unit of the independent variable, by which the result is multiplied.
    p : tuple of float
        Parameters of the scene. The function reads the drainage :math:`c^* D_c/V_*` from
        ``p[FLUID + 1]``.

    Returns
    -------
    tuple of float
        Change in the pore pressure per unit slip in :math:`D_c`, multiplied by
        ``slip_per_independent_variable``.
    """
    time = slip_per_independent_variable * math.exp(min(-log_slip_rate, LOG_SLOWNESS_UPPER_LIMIT))
    return (-p[FLUID + 1] * time * states[0],)


def return_zero_steady_pore_pressure(log_slip_rate: float, p: FloatTuple) -> FloatTuple:
    """Return the pore pressure of steady sliding, which is zero.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate. This argument is ignored.
    p : tuple of float
        Parameters of the scene. This argument is ignored.

    Returns
    -------
    tuple of float
        Pore pressure.
    """
    return (0.0,)


@dataclass(frozen=True, kw_only=True)
class ThermalFluid(Fluid):
    r"""Pore fluid that is pressurised by frictional heat and drains to the surroundings.

    The fluid expands when the temperature of the fault rises. The field ``temperature`` of the
    scene must be ``"shear_heating"``.

    Parameters
    ----------
    pressurisation : float, default: 1.0
        Pressurisation factor :math:`\Lambda_p T_*/\sigma_*`, where :math:`\Lambda_p` is the
        undrained increase in pore pressure per kelvin. If the temperature rises by :math:`T_*`
        without drainage, the pore pressure in :math:`\sigma_*` increases by this factor.
    drainage : float, default: 1.0
        Drainage rate :math:`c^* D_c/V_*`.
    dilatancy : float, default: 0.0
        Dilatancy :math:`\epsilon/(\beta \sigma_*)` (see ``DilatantFluid``). If the dilatancy is
        zero, the porosity is not an unknown.
    porosity_length : float, default: 1.0
        Slip distance :math:`L_\varphi/D_c` over which the porosity evolves (see ``DilatantFluid``).
        If the dilatancy is zero, the slip distance has no effect.

    Notes
    -----
    With the temperature rise :math:`\vartheta`, the pore pressure obeys

    .. math::

        \frac{dP}{dt} = \frac{\Lambda_p T_*}{\sigma_*} \frac{d\vartheta}{dt} - c^* P
          - \frac{d\varphi}{dt}.

    If the friction coefficient :math:`\mu` is constant and the fault neither cools nor drains, the
    pore pressure after the slip :math:`\delta` is :math:`P = 1 - \exp(-\mu E \delta)`, with
    :math:`E = H \Lambda_p T_*/\sigma_*`.

    References
    ----------
    Rice (2006), J. Geophys. Res. 111, B05311; Segall and Rice (2006), J. Geophys. Res. 111, B09316.
    """

    pressurisation: float = number(
        1.0,
        r"$\Lambda_p T_*/\sigma_*$",
        "1",
        "undrained increase of pore pressure due to a temperature rise of T_star",
        "sigma_*",
        rule=NON_NEGATIVE,
        omit_if_default=True,
    )
    dilatancy: float = declare_dilatancy_field(0.0)
    drainage: float = declare_drainage_field()
    porosity_length: float = declare_porosity_length_field()

    name = "thermal"

    @property
    def unknowns(self) -> tuple[Quantity, ...]:  # type: ignore[override]
        """Unknowns of the fluid: the porosity if the fault dilates, and the pressure."""
        return DilatantFluid.unknowns if self.dilatancy else (PORE_PRESSURE_QUANTITY,)

    @property
    def auxiliary_rates(self) -> NumericFunction:  # type: ignore[override]
        """Function that computes the rates of the unknowns without heating."""
        return (
            choose_porosity_rate_function(self.porosity_length)
            if self.dilatancy
            else compute_drainage_pressure_rate
        )

    @property
    def auxiliary_steady_states(self) -> NumericFunction:  # type: ignore[override]
        """Function that returns the unknowns in steady sliding."""
        return (
            compute_steady_porosity_and_pressure
            if self.dilatancy
            else return_zero_steady_pore_pressure
        )

    def compute_pore_pressure_upper_bound(self, log_slip_rate: float, states: FloatTuple) -> float:
        """Compute an upper bound on the future pore pressure without heating.

        See ``Fluid.compute_pore_pressure_upper_bound``.
        """
        if not self.dilatancy:
            return max(states[-1], 0.0)
        return DilatantFluid.compute_pore_pressure_upper_bound(self, log_slip_rate, states)  # type: ignore[arg-type]

    @property
    def pressurisation_factor(self) -> float:
        """Increase in pore pressure, in sigma_*, when an undrained fault heats up by T_*."""
        return self.pressurisation

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the active physical effects of the part."""
        return ("thermal_pressurisation", *("dilatancy",) * bool(self.dilatancy))

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        """Return the same parameters as for a dilatant fluid.

        See ``Part.parameter_values``. The pressurisation factor is stored with the parameters of
        the temperature part of the scene.
        """
        return DilatantFluid.parameter_values(self, scene)  # type: ignore[arg-type]

    def check(self, scene: SceneView) -> None:
        """Check the temperature, the porosity length and the stiffness ratio.

        See ``Part.check``.
        """
        if not scene.parts.temperature.unknowns:
            rule = f"does not apply to temperature={scene.parts.temperature.name!r}"
            remedy = "Set temperature='shear_heating', or choose another fluid."
            raise InvalidValue("fluid", self.name, rule, remedy=remedy)
        if self.dilatancy:
            check_porosity_length(self, scene)
        if lacks_critical_stiffness(scene):
            rule = (
                "cannot be used with stiffness_ratio, because no critical stiffness exists for "
                "this value with thermal pressurisation"
            )
            raise self.build_field_error(
                "drainage", rule, "Pass stiffness instead of stiffness_ratio, or increase drainage."
            )
