"""Tests of the misprints in the page of misprints.

The corrected formulas hold, and the printed formulas do not.
"""

import math
import re

import numpy as np
import pytest
from motion_helpers import cot_phi
from site_pages import PAGES

import rsfstudy
from rsfstudy import Scene
from rsfstudy.critical_steps.monotone_slip_rate_rise_check import (
    build_single_state_evolution_function,
)
from rsfstudy.slider.friction import build_friction_relation

PAGE = (PAGES / "explanation" / "misprints.md").read_text()


def test_eq_3():
    """Corrected eq. 3 describes a jump of normal stress at V = V_*.

    The reference is the assembled friction relation.
    """
    scene = Scene(alpha=0.56, phi=60.0)
    stress = 0.3  # of shear stress; normal stress follows
    change = cot_phi(scene) * stress
    psi = build_friction_relation(scene)(stress)[
        0
    ]  # the state at which V stays V_* under that stress
    state_change = psi - build_friction_relation(scene)(stress)[2]
    friction = scene.mu_star + state_change
    assert (1.0 + change) * friction == pytest.approx(scene.mu_star + stress, rel=1e-14)
    jump = -scene.alpha * math.log1p(change)
    corrected = scene.mu_star * change + (1.0 + change) * jump
    printed = scene.mu_star * change + jump
    direct = (1.0 + change) * (scene.mu_star + jump) - scene.mu_star
    assert corrected == pytest.approx(direct, rel=1e-14)
    assert abs(printed - direct) > 0.01


def test_eq_4b():
    """The state evolves by dTheta = b dtheta/theta per slip.

    The reference is dtheta/dt = 1 - theta V.
    """
    b, theta, rate = 0.029, 0.7, 3.0
    per_slip = build_single_state_evolution_function(Scene(law="slowness", a=b / 2.0))(
        math.log(rate), b * math.log(theta)
    )
    assert per_slip == pytest.approx(b * (1.0 - theta * rate) / theta / rate, rel=1e-13)


def test_eq_11():
    """Eq. 11 is exact at k = k_cr and too high at other stiffnesses.

    The differences agree with the page.
    """
    run = {"workers": 0, "output": None, "progress": False}
    ratios = [1.0, 1.1, 1.25, 1.5, 2.0]
    dataset = rsfstudy.run(
        "rate_step_stiffness",
        law="slip",
        case=["constant normal stress"],
        stiffness_ratio=ratios,
        **run,
    )
    short = 1.0 - dataset.over_eq_11.values.ravel()
    assert short[0] == pytest.approx(0.0, abs=1e-7)
    quoted = re.search(r"lower than the formula by ([\d., and]+) %", PAGE)
    assert quoted is not None
    numbers = [float(n) for n in re.findall(r"\d\.\d", quoted[1])]
    np.testing.assert_allclose(100.0 * short[1:], numbers, atol=0.051)
