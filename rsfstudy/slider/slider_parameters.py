"""Parameters that every slider has."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.parts import POSITIVE, Part, number
from rsfstudy.slider.scene_view import SceneView


@dataclass(frozen=True, kw_only=True)
class SliderParameters(Part):
    r"""Parameters that every slider has, whichever parts are selected.

    Parameters
    ----------
    a : float, default: 0.0145
        Direct effect parameter.
    mu_star : float, default: 0.76
        Steady-state friction coefficient at the reference velocity :math:`V_*`.
    stiffness_ratio : float, optional
        Ratio of the stiffness to the critical stiffness at :math:`V_*` without inertia or radiation
        damping.
    stiffness : float, optional
        Stiffness :math:`k D_c/\sigma_*`.
    period : float, default: 5.0
        Period :math:`T` of free oscillation in s.
    reference_rate : float, default: 1.17e-8
        Reference rate :math:`V_*/D_c` in 1/s.
    instability_norm : float, default: 5e-4
        Value of :math:`V T/(2 \pi D_c)` at which a motion is considered unstable.
    initial_stress : float, default: 0.0
        Deviation of the initial shear stress from steady sliding at :math:`V_*`, in
        :math:`\sigma_*`.
    initial_state : float, default: 0.0
        Initial state variable :math:`\Theta`, which is zero in steady sliding at :math:`V_*`.
    """

    a: float = number(0.0145, "$a$", "1", "direct effect parameter", rule=POSITIVE)
    mu_star: float = number(
        0.76,
        r"$\mu_*$",
        "1",
        "steady-state friction coefficient at the reference slip rate",
        rule=POSITIVE,
    )
    stiffness_ratio: float | None = number(
        None,
        r"$k/k_{cr}(V_*)$",
        "1",
        "stiffness divided by the critical stiffness at V_star without inertia or radiation "
        "damping",
        rule=POSITIVE,
    )
    stiffness: float | None = number(
        None, r"$k D_c/\sigma_*$", "1", "stiffness", "sigma_*/D_c", rule=POSITIVE
    )
    period: float = number(5.0, "$T$", "s", "period of free oscillation", rule=POSITIVE)
    reference_rate: float = number(
        1.17e-8, "$V_*/D_c$", "s-1", "reference slip rate divided by slip distance", rule=POSITIVE
    )
    instability_norm: float = number(
        5e-4,
        r"$VT/(2\pi D_c)$",
        "1",
        "slip rate norm above which the motion counts as unstable",
        rule=POSITIVE,
    )

    initial_stress: float = number(
        0.0,
        r"$(\tau_0-\tau_*)/\sigma_*$",
        "1",
        "initial shear stress minus the shear stress in steady sliding at V_star",
        "sigma_*",
    )
    initial_state: float = number(
        0.0, r"$\Theta_0$", "1", "initial state variable; 0 in steady sliding at V_star"
    )

    name = "slider"

    def check(self, scene: SceneView) -> None:
        """Check the initial stress and the initial state.

        See ``Part.check``.
        """
        if self.initial_stress <= -self.mu_star:
            rule = (
                f"must be greater than -mu_star, which is {-self.mu_star:g}, because the shear "
                "stress must be positive"
            )
            raise self.build_field_error("initial_stress", rule)
        if self.initial_state and scene.parts.law.state_count > 1:
            rule = (
                f"does not apply to law={scene.parts.law.name!r}, because the law has several "
                "state variables"
            )
            remedy = "Omit initial_state, and use a loading protocol to reach the initial state."
            raise self.build_field_error("initial_state", rule, remedy)


#: Names of the two alternative fields for the stiffness.
ALTERNATIVE_FIELD_NAMES_FOR_STIFFNESS = ("stiffness_ratio", "stiffness")


def add_default_stiffness_ratio(field_values: dict[str, Any]) -> dict[str, Any]:
    """Return slider parameters with exactly one field for the stiffness.

    Parameters
    ----------
    field_values : dict of str to float
        Values by field name.

    Returns
    -------
    dict of str to float
        Field values, with a stiffness ratio of 1 if no stiffness is given.

    Raises
    ------
    InvalidValue
        If both the stiffness and the stiffness ratio are given.
    """
    given = [name for name in ALTERNATIVE_FIELD_NAMES_FOR_STIFFNESS if name in field_values]
    if len(given) == 2:
        rule = f"cannot be combined with stiffness_ratio = {field_values['stiffness_ratio']:g}"
        raise InvalidValue(
            "stiffness", field_values["stiffness"], rule, remedy="Omit one of the two."
        )
    return field_values if given else {**field_values, "stiffness_ratio": 1.0}
