"""Published closed forms, by name: what reductions and figures hold results against."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class ClosedForm:
    """A formula of fields of a scene.

    Attributes
    ----------
    text : str
        The formula.
    fields : tuple of str
        Names of the fields it takes, in order.
    value : callable
        The formula as a function of those fields.
    source : str
        Where it is published.
    """

    text: str
    fields: tuple[str, ...]
    value: Callable[..., float]
    source: str


def critical_stiffness(
    log_rate: float, mu_star: float, a: float, b: float, cot_phi: float, alpha: float
) -> float:
    """Critical stiffness ``k_cr D_c/sigma_*`` as an explicit function of V, without mass: ``(b - a)
    sigma_* (1 - mu_* cot(phi)) / {D_c (1 - mu_ss cot(phi)) [1 - (mu_ss - alpha) cot(phi)]}`` with
    ``mu_ss = mu_* - (b - a) ln(V/V_*)`` (He et al. 1998).
    """
    mu_ss = mu_star - (b - a) * log_rate
    above = (b - a) * (1.0 - mu_star * cot_phi)
    return above / ((1.0 - mu_ss * cot_phi) * (1.0 - (mu_ss - alpha) * cot_phi))


FORMS: Mapping[str, ClosedForm] = {
    "velocity_step_at_critical_stiffness": ClosedForm(
        "V_0/V_* = 1 + a/(b-a)",
        ("b_over_a",),
        lambda b_over_a: 1.0 + 1.0 / (b_over_a - 1.0),
        "Gu et al. (1984), slip law, constant normal stress, k = k_cr",
    ),
    "velocity_step_for_b_over_a_of_e": ClosedForm(
        "V_0/V_* = exp(k/k_cr) a/(b-a)",
        ("b_over_a", "stiffness_ratio"),
        lambda b_over_a, ratio: math.exp(min(ratio, 700.0)) / (b_over_a - 1.0),
        "Gu et al. (1984), slip law, constant normal stress, b/a = e; exact at k = k_cr only",
    ),
    "displacement_step": ClosedForm(
        "D_c a/(b-a)",
        ("b_over_a",),
        lambda b_over_a: 1.0 / (b_over_a - 1.0),
        "Gu et al. (1984), slip law, constant normal stress, load point held",
    ),
    "net_weakening": ClosedForm(
        "(a-b) sigma_*",
        ("a", "b_over_a"),
        lambda a, b_over_a: a * (1.0 - b_over_a),
        "scale of stress drops against ln V_0: Cao and Aki (1986), Gu and Wong (1991)",
    ),
}
