"""Numbers known to more digits than anything measured, and how they were made.

Cycles and the critical step come from `tests/benchmarks/extended_precision.py`: the paper's own
unknowns instead of ours, extrapolated midpoint steps in 64-bit mantissas instead of SciPy's, the
error of leaving the slow manifold removed by Richardson extrapolation. Two such computations, with
the switch at slip rate norms of 0.02 and 0.01, agree to the uncertainty given here. The others are
closed forms, evaluated to 30 digits.
"""

from typing import NamedTuple

EXTENDED_PRECISION_SOURCE = (
    "other unknowns, extrapolation method, 64-bit mantissas (extended_precision.py)"
)


class KnownValue(NamedTuple):
    """A known number and its source; errors are relative to `scale`, or to the number where that is
    0, and so is its own `uncertainty`.
    """

    answer: float
    source: str = EXTENDED_PRECISION_SOURCE
    uncertainty: float = 0.0
    scale: float = 0.0


#: Slip law, constant normal stress, b/a = 2, k = 1.25 k_cr, norm 5e-4, without mass: critical
#: V_0/V_*, by bisection between motions; bisection ends at 1e-18.
CRITICAL_VELOCITY = KnownValue(
    2.633547063232728405, EXTENDED_PRECISION_SOURCE, 1e-17, 2.633547063232728405 - 1.0
)

#: The same at k = (1 + 1e-8) k_cr.
JUST_ABOVE_CRITICAL_STIFFNESS = KnownValue(1.9999494063490342617, scale=1.9999494063490342617 - 1.0)

#: Slowness law, alpha = 0.56, phi = 60 degrees, b/a = e, k = 1.5 k_cr: the paper's ~2361 V_*.
CRITICAL_VELOCITY_OF_SECTION_4 = KnownValue(2361.0972350083046758)

#: Limit cycles of b/a = 2, k = 0.8 k_cr, V_0 = 2 V_*, T = 5 s: static drop with the slip law, and
#: recurrence interval with the slowness law.
SLIP_STATIC_DROP = KnownValue(0.58233021615674673, uncertainty=4e-12)
SLOWNESS_RECURRENCE = KnownValue(23.93999870907226927, uncertainty=4e-13)

#: Slowness law, constant normal stress, k = k_cr, b/a = 2: log10 of the peak slip rate after a step
#: to 20 V_*, from the conserved quantity Omega - ln Omega + lambda (w - ln w); and to 200 V_*.
CONSERVED_QUANTITY_SOURCE = (
    "conserved quantity of the slowness law at k = k_cr (Ranjith and Rice 1999)"
)
PEAK_AFTER_20 = KnownValue(8.853655123157110332821499968933, CONSERVED_QUANTITY_SOURCE, scale=1.0)
PEAK_AFTER_200 = KnownValue(87.02666189007507609300213265385, CONSERVED_QUANTITY_SOURCE, scale=1.0)

#: Slowness law, constant normal stress, V = 200 V_*: slip until 1/e of the stress change is left,
#: ln[(V - 1)/(V**(1/e) - 1)] (eq. 17a).
EVOLUTION_DISTANCE = KnownValue(3.497775839483122296584238615316, "closed form (eq. 17a)", 1e-16)

#: Slip law, k = k_cr, b/a = 2, norm 5e-4 unless said otherwise: critical V_0/V_*; `hard_cases`.
HARD_STEPS = {
    label: KnownValue(answer, uncertainty=1e-15, scale=answer - 1.0)
    for label, answer in {
        "lambda = 0.01": 10.417946435269350385,
        "lambda = 20": 1.0500000000000000005,
        "a = 1e-4": 1.6346486284913022678,
        "a = 0.1": 1.8560075513444289114,
        "alpha = 0": 2.0584491076835686255,
        "alpha = mu_*": 1.5819027890637589848,
        "alpha = 1": 1.5093326843902126111,
        "phi = atan(mu_*) + 0.01": 1.0052116124727816295,
        "T = 1e-6 s": 1.6602536274751297222,
        "T = 1e4 s": 1.6386075335143061868,
    }.items()
}

#: Slip law, constant normal stress, b/a = 2: recurrence interval.
HARD_CYCLES = {
    "k = 0.99 k_cr": KnownValue(20.19254266647416257, uncertainty=4e-12),
    "V_0 = V_*": KnownValue(56.59980667862398402, uncertainty=4e-12),
    "T = 1e-6 s": KnownValue(47.38533572445342311, uncertainty=4e-12),
    "T = 1e4 s": KnownValue(17.26640860590658854, uncertainty=4e-12),
}

#: Variable normal stress, mass, any parameters (see `hard_cases`): recurrence interval. What the
#: switch costs falls with the square of its norm there, which is removed.
DOWN_TO_137 = KnownValue(0.79876073128172, uncertainty=3e-12)
DOWN_TO_1745 = KnownValue(49.2071554225251, uncertainty=3e-11)
