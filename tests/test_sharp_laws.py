"""Tests of the critical stiffness of laws with sharp bends in ln V."""

import math
from dataclasses import dataclass

import pytest
from scipy.special import lambertw

from rsfstudy import Scene
from rsfstudy.slider import stability
from rsfstudy.slider.evolution_derivatives import compute_state_evolution_derivatives
from rsfstudy.slider.laws import Law
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.slider.parts import POSITIVE, FloatTuple, number
from rsfstudy.slider.steady_state import compute_steady_sliding

#: Value of ln(V/V_*) at which steady friction bends.
BEND = 0.3


def resting(log_slip_rate, p):
    """Return the steady state, with a step added to -b ln(V/V_*).

    The step has a height of 2 w b and a width of w.
    """
    width = p[LAW + 1]
    bend = math.tanh((log_slip_rate - BEND) / width) + math.tanh(BEND / width)
    return -p[LAW] * (log_slip_rate + width * bend)


def evolution(log_slip_rate, state, p):
    return resting(log_slip_rate, p) - state


def steady_states(log_slip_rate, shift, p):
    return (shift + resting(log_slip_rate, p),)


@dataclass(frozen=True, kw_only=True)
class Bent(Law):
    bend_width: float = number(0.1, "$w$", "1", "width of the bend in ln V", rule=POSITIVE)

    name = "bent"
    evolution = staticmethod(evolution)
    steady_states = staticmethod(steady_states)

    def parameter_values(self, scene: Scene) -> FloatTuple:
        return (*super().parameter_values(scene), self.bend_width)


@pytest.mark.parametrize("width", [0.3, 0.1, 0.03, 0.005])
@pytest.mark.parametrize("place", [-2.0, -0.7, 0.0, 0.4, 1.5])
def test_critical_stiffness_of_a_law_that_bends_sharply(width, place):
    """The critical stiffness is -d(a x + Theta_ss)/dx.

    The law relaxes exponentially, so the critical stiffness is determined by the steady
    states.
    """
    scene = Scene(law=Bent, normal_stress="constant", a=0.01, stiffness=1e-3, bend_width=width)
    log_slip_rate = BEND + place * width
    exact = scene.b * (1.0 + 1.0 / math.cosh(place) ** 2) - scene.a
    ours = stability.compute_critical_stiffness(scene, log_slip_rate)
    steady = compute_steady_sliding(scene, log_slip_rate)
    assert steady is not None
    error = compute_state_evolution_derivatives(scene, steady).max_relative_error_estimate
    # The derivative is b/(b - a) = 2 times as large as its difference from a.
    assert abs(ours / exact - 1.0) < 2.0 * error < 1e-8


@pytest.mark.parametrize("log_slip_rate", [0.0, 4.5, 5.7, 6.9, 7.3])
def test_critical_stiffness_of_the_composite_law(log_slip_rate):
    """The critical stiffness is (1 + u)(b - a) + b u V/V_c.

    The variable u is the solution of u exp(u) = exp(-V/V_c).
    """
    scene = Scene(law="composite", normal_stress="constant", a=0.01, b_over_a=1.5, stiffness=1e-3)
    ratio = math.exp(log_slip_rate) / scene.cutoff_velocity_ratio
    u = float(lambertw(math.exp(-ratio)).real)
    exact = (1.0 + u) * (scene.b - scene.a) + scene.b * u * ratio
    ours = stability.compute_critical_stiffness(scene, log_slip_rate)
    # The factor b/(b - a) is 3, and differences with a step of 0.05 lose two to three digits.
    assert ours == pytest.approx(exact, rel=2e-11)
