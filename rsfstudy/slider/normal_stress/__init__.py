"""Normal stress conditions of the fault.

Each module of this package defines one normal stress condition. The function ``discover_parts``
finds the modules automatically. A normal stress condition defines how normal stress depends on
shear stress and on the loading. The base class is ``NormalStress``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from rsfstudy._deprecation import add_former_member_names
from rsfstudy.slider.parts import NumericFunction, Part, discover_parts
from rsfstudy.slider.quantities_required_by_parts import SHEAR_STRESS
from rsfstudy.slider.scene_view import SceneView


@add_former_member_names
@dataclass(frozen=True, kw_only=True)
class NormalStress(Part):
    r"""Base class of the normal stress conditions.

    If normal stress is not constant, define the function ``normal_stress(friction, p) -> (excess,
    change)`` as a static method. The argument ``friction`` is the deviation of frictional stress
    from its reference value, divided by :math:`\sigma_*`. The function returns
    :math:`\sigma/\sigma_* - 1` and its derivative with respect to ``friction``.

    Examples
    --------
    >>> from rsfstudy.parts import NormalStress
    >>> from rsfstudy.slider.normal_stress.variable import VariableNormalStress
    >>> issubclass(VariableNormalStress, NormalStress)
    True
    >>> round(VariableNormalStress(phi=45.0).coupling[0], 6)
    1.0
    """

    members_derived_from_equations = (
        "depends_on_shear_stress",
        "coupling",
        "compute_frictional_stress_lower_bound",
    )
    members_defining_equations = frozenset({"normal_stress", "state_effect", "parameter_values"})
    received_quantity_names = frozenset({SHEAR_STRESS})
    normal_stress: ClassVar[NumericFunction | None] = None

    @property
    def state_effect(self) -> NumericFunction | None:
        """Effect of normal stress on the state variable.

        The property is None if normal stress has no effect on the state. If normal stress affects
        the state, the property is a function ``state_effect(friction, ratio, change, p) -> (shift,
        slope)``. The shift is the decrease in the state variable due to normal stress, and the
        slope is the derivative of the shift with respect to frictional stress.
        """
        return None

    @property
    def depends_on_shear_stress(self) -> bool:
        """True if normal stress changes during slip under steady loading."""
        return bool(self.effects)

    @property
    def coupling(self) -> tuple[float, float] | None:
        r"""Coupling coefficients of normal stress.

        The first coefficient is the derivative of normal stress with respect to shear stress, and
        the second coefficient :math:`\alpha` is the effect of normal stress on the state. The
        property is None if two coefficients do not fully describe the normal stress condition.
        """
        return None

    def compute_frictional_stress_lower_bound(self, scene: SceneView) -> float:
        r"""Compute the frictional stress at which normal stress vanishes.

        Parameters
        ----------
        scene : Scene
            Scene that the normal stress condition belongs to.

        Returns
        -------
        float
            Deviation of frictional stress from its reference value, in :math:`\sigma_*`. The base
            class returns negative infinity.
        """
        return -math.inf


BUILT_IN_NORMAL_STRESS_CLASS_BY_NAME = discover_parts(__name__, __path__)
