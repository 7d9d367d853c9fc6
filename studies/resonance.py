"""Resonance: what oscillating normal stress makes of spring stress, against its period."""

import math

from rsfstudy.declare.axis import Axis
from rsfstudy.declare.claims import Claim
from rsfstudy.declare.study import Study
from rsfstudy.measures.normal_stress_response import NormalStressResponse
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.reduce import Inverse
from rsfstudy.slider.scene import Scene

base = Scene(normal_stress="imposed", alpha=0.25, b_over_a=2.0)
a, b = base.a, base.b
#: Period of resonance as k falls to k_cr, 2 pi over sqrt((b - a)/a), and others over it.
RESONANT = 2.0 * math.pi * math.sqrt(a / (b - a))
PERIODS = [factor * RESONANT for factor in (0.75, 1.0, 1.5)]
RATIOS = [1.2, 1.5, 4.0]
SMALL, LARGE = 1e-4, 1e-2
AMPLITUDES = [SMALL, 3e-4, 1e-3, 3e-3, LARGE, 5e-2]
LAWS = ("slip", "slowness")
#: Departure of the response from that of small oscillations beyond which linear theory has failed.
FAILED = 0.1
LINEAR = "linear theory of steady sliding: K [mu + (mu - alpha) z]/[a z^2 + (K - b + a) z + K]"


def linear(ratio: float, period: float) -> float:
    """Gain of small oscillations, in units with stress over sigma and z = i omega D_c/V."""
    stiffness, z = ratio * (b - a), 2j * math.pi / period
    above = stiffness * (base.mu_star + (base.mu_star - base.alpha) * z)
    return float(abs(above / (a * z * z + (stiffness - b + a) * z + stiffness)))


def swing(ratio: float, period: float, amplitude: float) -> float:
    """Amplitude of ln V in small oscillations: V - V_0 is -d(spring stress)/dt over K."""
    return 2.0 * math.pi / period * linear(ratio, period) * amplitude / (ratio * (b - a))


def is_linear(law: str, ratio: float, period: float) -> Claim:
    """R1: the limit of small amplitude."""
    gain = linear(ratio, period)
    return Claim(
        id="R1",
        statement=f"{law} law, k = {ratio:g} k_cr, {period / RESONANT:g} times the resonant "
        "period: gain of small oscillations",
        source=LINEAR,
        variable="gain",
        where={
            "law": law,
            "stiffness_ratio": ratio,
            "oscillation_period": period,
            "oscillation_amplitude": SMALL,
        },
        published=gain,
        tolerance=gain * (swing(ratio, period, SMALL) ** 2 + 1e-6),
        reason="linear theory leaves out the square of the amplitude of ln V, up to 5e-4; and 1e-6",
    )


def resounds(law: str, period: float) -> Claim:
    """R2: the period of resonance."""
    at = {"law": law, "stiffness_ratio": RATIOS[0], "oscillation_amplitude": SMALL}
    return Claim(
        id="R2",
        statement=f"{law} law, k = {RATIOS[0]:g} k_cr: gain is larger than at "
        f"{period / RESONANT:g} times the period",
        source="linear theory: resonance at omega D_c/V = sqrt((b - a)/a) as k falls to k_cr",
        variable="gain",
        where={**at, "oscillation_period": RESONANT},
        minus={**at, "oscillation_period": period},
        relation="above",
        published=0.0,
        tolerance=0.0,
        reason="an inequality",
    )


def holds(law: str, ratio: float, amplitude: float, *, still: bool = True) -> Claim:
    """R3: up to which amplitude, near critical stiffness and far from it."""
    return Claim(
        id="R3",
        statement=f"{law} law, k = {ratio:g} k_cr at resonance, A = {amplitude:g}: linear theory "
        f"{'holds' if still else 'no longer holds'} to a tenth",
        source="it takes changes of ln V for small, which grow as the gain",
        variable="departure_from_linear",
        where={
            "law": law,
            "stiffness_ratio": ratio,
            "oscillation_period": RESONANT,
            "oscillation_amplitude": amplitude,
        },
        relation="below" if still else "above",
        published=FAILED,
        tolerance=0.0,
        reason="an inequality",
    )


def fails_earlier(softer: float, stiffer: float) -> Claim:
    """R4: the amplitude at which linear theory fails."""
    at = {"law": "slowness", "oscillation_period": RESONANT}
    return Claim(
        id="R4",
        statement=f"slowness law: linear theory fails at a smaller amplitude at {softer:g} k_cr "
        f"than at {stiffer:g} k_cr",
        source="changes of ln V grow as the gain, which is larger nearer to critical stiffness",
        variable="failing_amplitude",
        where={**at, "stiffness_ratio": softer},
        minus={**at, "stiffness_ratio": stiffer},
        relation="below",
        published=0.0,
        tolerance=0.0,
        reason="an inequality",
    )


study = Study(
    name="resonance",
    title="Response to oscillating normal stress, b/a = 2",
    summary=(
        "Imposed normal stress oscillates around steady sliding, and spring stress with it. Small "
        "oscillations resound at the period 2 pi sqrt(a/(b - a)) D_c/V as stiffness falls to "
        "critical, by either law. The closer stiffness is to critical, the smaller the amplitude "
        "at which linear theory fails."
    ),
    base=base,
    axes=[
        Axis("law", LAWS),
        Axis("stiffness_ratio", RATIOS),
        Axis("oscillation_period", PERIODS),
        Axis("oscillation_amplitude", AMPLITUDES),
    ],
    measure=NormalStressResponse(samples=32),
    accuracy=Accuracy(rtol=1e-5),
    reductions=[
        Inverse(
            name="failing_amplitude",
            of="departure_from_linear",
            on="oscillation_amplitude",
            levels=FAILED,
        ),
    ],
    claims=[
        *(is_linear("slip", ratio, period) for ratio in RATIOS for period in PERIODS),
        *(is_linear("slowness", ratio, RESONANT) for ratio in RATIOS),
        *(resounds(law, period) for law in LAWS for period in (PERIODS[0], PERIODS[-1])),
        holds("slip", RATIOS[0], 3e-3, still=False),
        holds("slowness", RATIOS[0], LARGE, still=False),
        *(holds(law, RATIOS[-1], LARGE) for law in LAWS),
        fails_earlier(RATIOS[0], RATIOS[1]),
    ],
    plot="resonance",
    references=[
        "Perfettini, Schmittbuhl, Rice and Cocco (2001), J. Geophys. Res. 106, 13455-13472",
        "Boettcher and Marone (2004), J. Geophys. Res. 109, B03406",
    ],
)
