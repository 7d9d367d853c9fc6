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
