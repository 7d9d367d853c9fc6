"""Linear stability: algebra and assembled equations vouch for each other."""

import pytest

from rsfstudy import Scene
from rsfstudy.measures.linear_stability import growth, jacobian
from rsfstudy.slider.equations import by_displacement


@pytest.mark.parametrize("off", [-1e-3, -1e-8, 1e-8, 1e-3])
@pytest.mark.parametrize("effects", [{"normal_stress": "constant"}, {"alpha": 0.56}])
def test_growth_close_to_critical_stiffness(off, effects):
    """At K = K_cr (1 + d), a p**2 + (E K - (b-a)) p + D K = 0 per time D_c/V_*: twice the growth
    rate is -(b-a) d/a, and a half of that per slip and load point displacement.
    """
    scene = Scene(stiffness_ratio=1.0 + off, **effects)
    expected = -0.25 * (scene.b_over_a - 1.0) * off
    # central differences are right to 6e-10 of rates of order one
    grows = growth(jacobian(by_displacement(scene), (0.0, 0.0)))
    assert grows == pytest.approx(expected, rel=1e-5, abs=1e-9)
    assert grows * off < 0.0
