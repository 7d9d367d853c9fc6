r"""Temperature of the fault.

Each module of this package defines one temperature model. The function ``discover_parts`` finds the
modules automatically. The unknown is the temperature rise :math:`\vartheta = (T - T_*)/T_*`,
relative to the absolute temperature :math:`T_*` of steady sliding at :math:`V_*`. If the friction
depends on temperature,

.. math::

    \mu = \mu_* + a \left(\ln\frac{V}{V_*} + q_a \Lambda\right) + \Theta, \quad
    \Lambda = \frac{T_*}{T} - 1 = -\frac{\vartheta}{1 + \vartheta},

and the offset :math:`u` of the state variable from its steady state increases by
:math:`q_b \Lambda`. With the activation energies :math:`Q_a` and :math:`Q_b`,
:math:`q_i = Q_i/(R T_*)`. The base class is ``Temperature``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from rsfstudy.slider.parts import NumericFunction, Part, discover_parts
from rsfstudy.slider.quantities_required_by_parts import (
    EFFECTIVE_NORMAL_STRESS,
    FRICTION_COEFFICIENT,
    SHEAR_STRESS,
    SLIP_RATE,
)
from rsfstudy.slider.scene_view import SceneView


@dataclass(frozen=True, kw_only=True)
class Temperature(Part):
    r"""Base class of the temperature models of the fault.

    If the temperature changes, the ``unknowns`` attribute of the subclass contains a single
    unknown, the temperature rise. The subclass also defines the following function as a static
    method:

    - ``temperature_rate(log_slip_rate, rise, friction, normal_stress, fraction, parameters)``
      returns the change in the temperature rise per unit slip in :math:`D_c`, multiplied by
      ``fraction``, which is the slip per unit of the independent variable. The argument
      ``friction`` is the friction coefficient, and ``normal_stress`` is the effective normal stress
      in :math:`\sigma_*`. The tuple ``parameters`` contains the values of ``parameter_values``,
      followed by the other fields that the class declares with ``number``. The rate must be zero if
      the fault slides steadily at :math:`V_*` with a temperature rise of zero.

    A motion is considered settled if the unknowns are close to their values in steady sliding. The
    temperature rise is excluded from this comparison, because it may be extremely large in a
    rupture.

    Examples
    --------
    >>> from rsfstudy import Scene
    >>> from rsfstudy.slider.temperature import Temperature
    >>> scene = Scene()
    >>> isinstance(scene.parts.temperature, Temperature)
    True
    >>> scene.temperature
    'isothermal'
    """

    received_quantity_names = frozenset(
        {SLIP_RATE, FRICTION_COEFFICIENT, EFFECTIVE_NORMAL_STRESS, SHEAR_STRESS}
    )
    temperature_rate: ClassVar[NumericFunction | None] = None

    @classmethod
    def list_required_function_names(cls) -> tuple[str, ...]:
        """Return the names of the functions that the subclass must define.

        Returns
        -------
        tuple of str
            ``("temperature_rate",)`` if the temperature is an unknown, and otherwise an empty
            tuple.
        """
        return ("temperature_rate",) if cls.unknowns else ()

    @property
    def dimensionless_activation_energies(self) -> tuple[float, float]:
        """Activation terms of the direct effect and of the evolution effect.

        In the base class, friction does not depend on temperature, and both terms are zero.
        """
        return 0.0, 0.0

    def compute_temperature_rise_bounds(
        self, scene: SceneView, temperature_rise: float, max_frictional_power: float
    ) -> tuple[float, float]:
        r"""Compute bounds on the future temperature rise.

        Parameters
        ----------
        scene : Scene
            Scene that contains the temperature model.
        temperature_rise : float
            Current temperature rise.
        max_frictional_power : float
            Upper bound on the product of shear stress and slip rate, in :math:`\sigma_* V_*`.

        Returns
        -------
        tuple of (float, float)
            Lower and upper bound of the temperature rise. The base class returns infinite bounds.
        """
        return -math.inf, math.inf


BUILT_IN_TEMPERATURE_CLASS_BY_NAME = discover_parts(__name__, __path__)
