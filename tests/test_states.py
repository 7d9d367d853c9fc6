"""A law may have several states: two of equal length must be one state, in every measure."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from rsfstudy import Scene, simulate
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.measures.linear_stability import LinearStability
from rsfstudy.measures.rigid_response import RigidResponse
from rsfstudy.measures.step_response import StepResponse
from rsfstudy.measures.triggered import Triggered
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.slider import laws, stability, steady
from rsfstudy.slider.equations import between_ruptures, in_rupture, rigid
from rsfstudy.slider.laws.slip import SlipLaw
from rsfstudy.slider.laws.slowness import SlownessLaw
from rsfstudy.slider.parts import number
from rsfstudy.slider.places import LAW
from rsfstudy.status import Status

FIRST = 0.3  # share of the first state in b
CONSTANT = {"normal_stress": "constant"}


def steady_states(log_rate, shift, p):
    return tuple(part * (shift - p[LAW] * log_rate) for part in (FIRST, 1.0 - FIRST))


def two_slip_states(log_rate, psis, shift, share, p):
    b = p[LAW]
    return (
        -share * (psis[0] - FIRST * shift + FIRST * b * log_rate),
        -share * (psis[1] - (1.0 - FIRST) * shift + (1.0 - FIRST) * b * log_rate),
    )


def two_slowness_states(log_rate, psis, shift, share, p):
    one, other = FIRST * p[LAW], (1.0 - FIRST) * p[LAW]
    return (
        share * one * math.expm1(min(-((psis[0] - FIRST * shift) / one + log_rate), 700.0)),
        share
        * other
        * math.expm1(min(-((psis[1] - (1.0 - FIRST) * shift) / other + log_rate), 700.0)),
    )


@dataclass(frozen=True, kw_only=True)
class TwoSlipStates(SlipLaw):
    name = "parted_slip"
    states = 2
    evolution = None
    evolutions = staticmethod(two_slip_states)
    steady_states = staticmethod(steady_states)


@dataclass(frozen=True, kw_only=True)
class TwoSlownessStates(SlownessLaw):
    name = "parted_slowness"
    states = 2
    evolution = None
    evolutions = staticmethod(two_slowness_states)
    steady_states = staticmethod(steady_states)


def of_two_lengths(log_rate, psis, shift, share, p):
    ratio, second = p[LAW], p[LAW + 1]
    return (
        -share * (psis[0] - shift + (p[1] - second) * log_rate),
        -share * ratio * (psis[1] + second * log_rate),
    )


def resting_at_two_lengths(log_rate, shift, p):
    second = p[LAW + 1]
    return (shift - (p[1] - second) * log_rate, -second * log_rate)


@dataclass(frozen=True, kw_only=True)
class TwoLengths(laws.Law):
    """The slip law twice, with L_1/L_2 and b_2 of its own; b is that of both."""

    first_over_second: float = number(1.0, "", "1", "first over second slip distance")
    second: float = number(0.0, "", "1", "evolution effect of the second state")

    name = "two_lengths"
    states = 2
    evolutions = staticmethod(of_two_lengths)
    steady_states = staticmethod(resting_at_two_lengths)

    def numbers(self, scene):
        return self.first_over_second, self.second


LAWS = {"slip": TwoSlipStates, "slowness": TwoSlownessStates}
PAIRS = [("slip", CONSTANT), ("slip", {}), ("slowness", CONSTANT), ("slowness", {})]


def both(law: str, **fields) -> tuple[Scene, Scene]:
    """One state and two."""
    return Scene(law=law, **fields), Scene(law=LAWS[law], **fields)


def agree(measure, one, two, rtol=1e-7, budget=2_000_000) -> None:
    """Headline numbers of both within the sum of their error estimates."""
    found, again = (measure(scene, Accuracy(rtol, budget)) for scene in (one, two))
    assert again.status is found.status
    for name in (n for n in found.values if f"{n}_error" in found.values):
        value, other = found.values[name], again.values[name]
        allowed = found.values[f"{name}_error"] + again.values[f"{name}_error"]
        assert other == pytest.approx(value, abs=allowed + 1e-14 * abs(value)), name


@pytest.mark.parametrize(("law", "fields"), PAIRS)
def test_the_equations_add_up(law, fields):
    """The states of two add up to the one, in every form; each form has one unknown more."""
    one, two = both(law, load_velocity_ratio=3.0, inertia=True, **fields)
    steady_one, steady_two = (steady.steady_sliding(s, 0.4) for s in (one, two))
    assert sum(steady_two.psis) == pytest.approx(steady_one.psis[0], rel=1e-13)
    psi = 0.02
    split = (FIRST * psi, (1.0 - FIRST) * psi)
    slow, slow_of_two = (between_ruptures(s, clock=False) for s in (one, two))
    rates, of_two = slow.rates((0.03, psi)), slow_of_two.rates((0.03, *split))
    assert len(of_two) == len(slow_of_two.unknowns) == 3
    assert (of_two[0], of_two[1] + of_two[2]) == pytest.approx(rates, rel=1e-11)
    state = (0.01, 0.3, 0.012)
    fast = in_rupture(one).rates(state)
    psi = in_rupture(one).at(state).psi
    of_two = in_rupture(two).rates((*state, (1.0 - FIRST) * psi))
    assert of_two[:3] == pytest.approx(fast, rel=1e-11)
    assert len(rigid(two, 0.3).unknowns) == 2


@pytest.mark.parametrize(("law", "fields"), PAIRS)
@pytest.mark.parametrize("inertia", [False, True])
def test_critical_stiffness_and_growth(law, fields, inertia):
    one, two = both(law, inertia=inertia, stiffness=0.02, load_velocity_ratio=2.0, **fields)
    assert two.critical_stiffness == pytest.approx(one.critical_stiffness, rel=1e-11)
    rates = stability.growth_rates(two, 0.7)
    for rate in stability.growth_rates(one, 0.7):
        assert np.abs(rates - rate).min() < 1e-7 * abs(rate)
    agree(LinearStability(), one.with_(stiffness_ratio=1.0), two.with_(stiffness_ratio=1.0))


@pytest.mark.parametrize(("law", "fields"), PAIRS)
def test_cycles_and_responses(law, fields):
    one, two = both(law, stiffness_ratio=0.8, load_velocity_ratio=2.0, inertia=True, **fields)
    agree(LimitCycle(phases=50), one, two, rtol=1e-6)
    agree(StepResponse(peaks=2, phases=50), one.with_(inertia=False, stiffness_ratio=2.0),
          two.with_(inertia=False, stiffness_ratio=2.0), rtol=1e-6)  # fmt: skip
    agree(RigidResponse(points=5), one, two)


@pytest.mark.parametrize(("law", "fields"), PAIRS)
def test_critical_steps_by_motions(law, fields):
    """One state has its touching path, and two go the general way: the boundary is the same."""
    one, two = both(law, stiffness_ratio=1.3, **fields)
    for of in ("load_velocity_ratio", "displacement_step"):
        agree(CriticalStep(of=of), one, two, rtol=1e-4)
    agree(Triggered(), *(s.with_(load_velocity_ratio=30.0) for s in (one, two)))


APART = 0.05


def resting_apart(log_rate, shift, p):
    one, other = steady_states(log_rate, shift, p)
    return one + APART, other - APART


def two_states_apart(log_rate, psis, shift, share, p):
    return two_slip_states(log_rate, (psis[0] - APART, psis[1] + APART), shift, share, p)


@dataclass(frozen=True, kw_only=True)
class TwoStatesApart(TwoSlipStates):
    name = "two_states_apart"
    evolutions = staticmethod(two_states_apart)
    steady_states = staticmethod(resting_apart)


def test_states_that_rest_apart_begin_at_rest():
    """Steady sliding at V_* is that of the law, which need not be zero in each state."""
    fields = {"stiffness_ratio": 1.5, "load_velocity_ratio": 1.3}
    one, two = (Scene(law=law, **fields) for law in ("slip", TwoStatesApart))
    motions = [simulate(scene, duration=10.0) for scene in (one, two)]
    ends = [float(motion["log10_slip_rate"][-1]) for motion in motions]
    assert ends[1] == pytest.approx(ends[0], abs=1e-6)
    agree(RigidResponse(points=5), one, two)


def test_trajectories():
    one, two = (simulate(s, duration=20.0) for s in both("slowness", load_velocity_ratio=3.0))
    assert two["state_variable"][-1] == pytest.approx(float(one["state_variable"][-1]), abs=1e-7)


@pytest.mark.parametrize(
    ("first", "second", "ratio", "expected"),
    [(1.0, 0.84, 0.048, 0.0802755656), (1.4, -0.6, 0.02, 0.38741)],
)
def test_two_lengths(first, second, ratio, expected):
    """Critical stiffness k L_1/(a sigma) of two states of different lengths, against published
    numbers and the closed form of the Routh-Hurwitz criterion for their cubic (Gu et al. 1984);
    rate strengthening does not exclude instability (the second).
    """
    a = 0.01
    scene = Scene(
        law=TwoLengths,
        a=a,
        b_over_a=first + second,
        second=second * a,
        first_over_second=ratio,
        stiffness=0.01,
        **CONSTANT,
    )
    assert scene.critical_stiffness / a == pytest.approx(expected, rel=2e-5)  # digits given
    half = first - 1.0 + ratio * (2.0 * first + (second - 1.0) * (2.0 + ratio))
    product = (
        ratio * (1.0 + ratio) * (first + second - 1.0) * (1.0 + ratio - first - second * ratio)
    )
    closed = (half + math.sqrt(half**2 + 4.0 * product)) / (2.0 + 2.0 * ratio)
    assert scene.critical_stiffness / a == pytest.approx(closed, rel=1e-9)
    agree_on = LinearStability()(scene.with_(stiffness=0.9 * scene.critical_stiffness), Accuracy())
    assert agree_on.status in (Status.OK, Status.STABLE_AT_ANY_STIFFNESS)


@pytest.mark.parametrize(
    ("b_over_a", "second", "first_over_second", "load"),
    [
        (1.4651462863, 0.0138187125, 3.7746346349, 1.3),
        (2.3188214826, 0.0143733403, 0.1910147365, 1.1),
    ],
)
def test_peaks_of_two_states_may_fall_before_they_rise(b_over_a, second, first_over_second, load):
    """With three unknowns paths pass each other: only the norm, or rest, decides."""
    scene = Scene(
        law=TwoLengths,
        b_over_a=b_over_a,
        second=second,
        first_over_second=first_over_second,
        stiffness_ratio=0.9,
        load_velocity_ratio=load,
        **CONSTANT,
    )
    outcome = Triggered()(scene, Accuracy(1e-5, 2_000_000))
    assert (outcome.status, outcome.values.get("unstable")) == (Status.OK, 1.0)


@pytest.mark.parametrize(
    "fields",
    [
        {"b_over_a": 12.0, "first_over_second": 3.0, "second": 0.05 * 12.0 * 0.0145},
        {"b_over_a": 16.0, "first_over_second": 2.0, "second": 0.05 * 16.0 * 0.0145},
        {
            "b_over_a": 1.4658,
            "first_over_second": 0.4007,
            "second": 0.3854 * 1.4658 * 0.0145,
            "inertia": True,
            "period": 227374.0,
            "load_velocity_ratio": math.exp(1.6316),
        },
    ],
)
def test_growth_of_two_states_has_its_threshold_at_the_critical_stiffness(fields):
    outcome = LinearStability()(Scene(law=TwoLengths, **fields, **CONSTANT), Accuracy())
    assert outcome.status is Status.OK
    values = outcome.values
    assert values["critical_stiffness_error"] < 1e-6 * values["critical_stiffness"]
