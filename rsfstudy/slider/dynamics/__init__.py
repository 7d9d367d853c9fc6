"""Dynamics of the slider.

Each module of this package defines one choice of dynamics. The function ``discover_parts`` finds
the modules automatically. The dynamics define the forces that, together with friction, balance the
spring force. This force balance determines how the slip rate depends on spring stress and state.
The base class is ``Dynamics``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rsfstudy._deprecation import add_former_member_names
from rsfstudy.slider.parts import NumericFunction, Part, discover_parts
from rsfstudy.slider.quantities_required_by_parts import QUANTITIES_A_PART_MAY_NEED
from rsfstudy.slider.scene_view import SceneView


@add_former_member_names
@dataclass(frozen=True, kw_only=True)
class Dynamics(Part):
    r"""Base class of the dynamics.

    The dynamics are defined by functions that receive the friction of a scene and return functions
    of floats. The friction of a scene is passed as an instance of
    ``rsfstudy.slider.FrictionFunctions``. The dynamics have the following functions:

    - ``build_slip_rate_functions(friction)`` returns two functions. The function ``balance(spring,
      psis, p)`` returns :math:`\ln(V/V_*)`, the frictional stress g and the decrease in the state
      due to stress. The function ``growth(state, rates, x, g, p)`` returns the derivative of
      :math:`x = \ln(V/V_*)` along the motion. The argument ``state`` contains the spring stress and
      the states ``psis``, and ``rates`` contains the derivatives of ``state``.
    - ``build_rate_function_for_ruptures(friction)`` is optional. It returns a function
      ``rate(state, p)`` with the inertial equations of motion, which are integrated during
      ruptures. The function ``rate`` returns derivatives with respect to inertial time. The
      unknowns are the spring stress f, the logarithm x = ln(V/V_*), the frictional stress g, and
      all states except the first.

    Examples
    --------
    >>> from rsfstudy import Scene
    >>> from rsfstudy.parts import Dynamics
    >>> scene = Scene(inertia=True)
    >>> isinstance(scene.parts.dynamics, Dynamics)
    True
    >>> scene.parts.dynamics.name
    'inertia'
    """

    #: Name of the equations of motion between ruptures. The name appears in results.
    regime_name: ClassVar[str]
    received_quantity_names = frozenset(QUANTITIES_A_PART_MAY_NEED)
    build_slip_rate_functions: ClassVar[NumericFunction]
    build_rate_function_for_ruptures: ClassVar[NumericFunction | None] = None
    #: True if slip may reverse in scenes with the regularised friction law.
    allows_reversed_slip: ClassVar[bool] = False

    @classmethod
    def list_required_function_names(cls) -> tuple[str, ...]:
        """Return the names of the functions that the dynamics must define.

        Returns
        -------
        tuple of str
            ``("build_slip_rate_functions",)``.
        """
        return ("build_slip_rate_functions",)

    def radiated_stress(self, log_slip_rate: float) -> float:
        r"""Compute the stress reduction due to the radiation of seismic waves.

        Parameters
        ----------
        log_slip_rate : float
            Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.

        Returns
        -------
        float
            Radiated stress in :math:`\sigma_*`. The base class returns zero.
        """
        return 0.0

    def radiated_stress_slope(self, log_slip_rate: float) -> float:
        r"""Compute the derivative of the radiated stress with respect to ln V.

        Parameters
        ----------
        log_slip_rate : float
            Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.

        Returns
        -------
        float
            Derivative in :math:`\sigma_*`. The base class returns zero.
        """
        return 0.0

    def compute_slip_rate_norm(self, scene: SceneView, log_slip_rate: float) -> float:
        r"""Compute the slip rate norm, which measures the effect of inertia.

        Parameters
        ----------
        scene : Scene
            Scene that the dynamics belong to.
        log_slip_rate : float
            Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.

        Returns
        -------
        float
            Norm :math:`w = V T/(2 \pi D_c)`. The base class returns zero, because it does not
            include inertia.
        """
        return 0.0


BUILT_IN_DYNAMICS_CLASS_BY_NAME = discover_parts(__name__, __path__)
