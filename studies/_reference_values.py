"""Reference values for the numerical accuracy of the package.

The values of limit cycles and of critical steps were computed with
``tests/benchmarks/extended_precision.py``. The program ``extended_precision.py`` integrates the
equations in the variables of the paper, which differ from the variables of rsfstudy. The program
uses extrapolated midpoint steps in extended precision (64-bit mantissa), and removes the error of
the slow manifold by Richardson extrapolation. Each value was computed twice. The program switches
from the equations without inertia to the equations with inertia at a given norm of the slip rate.
This norm was 0.02 in the first computation and 0.01 in the second computation. The two results
agree to within the uncertainty that is listed with each value. All other values are closed forms
that were evaluated to 30 digits.
"""

from typing import NamedTuple

EXTENDED_PRECISION_SOURCE = (
    "other unknowns, extrapolation method, 64-bit mantissas (extended_precision.py)"
)


class KnownValue(NamedTuple):
    """Known value and its source.

    Parameters
    ----------
    answer : float
        Known value.
    source : str, optional
        Source of the value.
    uncertainty : float, default: 0.0
        Error of the value, relative to ``scale``.
    scale : float, default: 0.0
        Value by which errors are divided. If the scale is zero, errors are divided by the known
        value.
    """

    answer: float
    source: str = EXTENDED_PRECISION_SOURCE
    uncertainty: float = 0.0
    scale: float = 0.0


#: Critical V_0/V_* for the slip law, constant normal stress, b/a = 2, k = 1.25 k_cr and an
#: instability norm of 5e-4, without inertia. The value was found by bisection between stable and
#: unstable motions, to a precision of 1e-18.
CRITICAL_VELOCITY = KnownValue(
    2.633547063232728405, EXTENDED_PRECISION_SOURCE, 1e-17, 2.633547063232728405 - 1.0
)

#: Critical V_0/V_* for the parameters of ``CRITICAL_VELOCITY``, except that k = (1 + 1e-8) k_cr.
JUST_ABOVE_CRITICAL_STIFFNESS = KnownValue(1.9999494063490342617, scale=1.9999494063490342617 - 1.0)

#: Critical V_0/V_* for the slowness law, alpha = 0.56, phi = 60 degrees, b/a = e and k = 1.5 k_cr.
#: The paper reports approximately 2361.
CRITICAL_VELOCITY_OF_SECTION_4 = KnownValue(2361.0972350083046758)

#: Static stress drop (slip law) and recurrence interval (slowness law) of limit cycles with b/a =
#: 2, k = 0.8 k_cr, V_0 = 2 V_* and T = 5 s.
SLIP_STATIC_DROP = KnownValue(0.58233021615674673, uncertainty=4e-12)
SLOWNESS_RECURRENCE = KnownValue(23.93999870907226927, uncertainty=4e-13)

#: Decimal logarithm of the peak slip rate after velocity steps to 20 V_* and 200 V_*, for the
#: slowness law, constant normal stress, k = k_cr and b/a = 2. The values follow from the conserved
#: quantity Omega - ln Omega + lambda (w - ln w).
CONSERVED_QUANTITY_SOURCE = (
    "conserved quantity of the slowness law at k = k_cr (Ranjith and Rice 1999)"
)
PEAK_AFTER_20 = KnownValue(8.853655123157110332821499968933, CONSERVED_QUANTITY_SOURCE, scale=1.0)
PEAK_AFTER_200 = KnownValue(87.02666189007507609300213265385, CONSERVED_QUANTITY_SOURCE, scale=1.0)

#: Slip after which 1/e of the stress change remains, ln[(V - 1)/(V**(1/e) - 1)] in D_c, for the
#: slowness law, constant normal stress and V = 200 V_* (eq. 17a).
EVOLUTION_DISTANCE = KnownValue(3.497775839483122296584238615316, "closed form (eq. 17a)", 1e-16)

#: Critical V_0/V_* for the slip law, k = k_cr, b/a = 2 and an instability norm of 5e-4, except for
#: the parameter in the name of each value. The study ``hard_cases`` uses these values.
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

#: Recurrence intervals for the slip law, constant normal stress and b/a = 2.
HARD_CYCLES = {
    "k = 0.99 k_cr": KnownValue(20.19254266647416257, uncertainty=4e-12),
    "V_0 = V_*": KnownValue(56.59980667862398402, uncertainty=4e-12),
    "T = 1e-6 s": KnownValue(47.38533572445342311, uncertainty=4e-12),
    "T = 1e4 s": KnownValue(17.26640860590658854, uncertainty=4e-12),
}

#: Recurrence intervals for variable normal stress and inertia, with random parameters (see the
#: study ``hard_cases``). In these cases, the change between the equations without and with inertia
#: causes an error. This error decreases with the square of the slip rate norm at the change, and
#: was removed by extrapolation.
DOWN_TO_137 = KnownValue(0.79876073128172, uncertainty=3e-12)
DOWN_TO_1745 = KnownValue(49.2071554225251, uncertainty=3e-11)
