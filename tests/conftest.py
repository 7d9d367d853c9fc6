"""Shared by the tests: scenes, and integration with few words."""

from __future__ import annotations

import os
from collections.abc import Callable

import pytest
from hypothesis import HealthCheck, settings

from rsfstudy import Scene
from rsfstudy.core.accuracy import Accuracy
from rsfstudy.core.motion import motion
from rsfstudy.core.stepping import Meter, Step

settings.register_profile(
    "default", deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize=True
)
settings.load_profile("default")
os.environ.setdefault("MPLBACKEND", "agg")


def follow(
    scene: Scene, rtol: float, until: Callable[[Step], bool], budget: int = 2_000_000
) -> Meter:
    """Integrate a scene until the callback, which sees every step, says so."""
    meter = Meter(budget)
    for step in motion(scene, Accuracy(rtol, budget), meter, clock=True):
        if until(step):
            return meter
    raise AssertionError("a motion never ends by itself")


@pytest.fixture
def constant() -> Scene:
    """Slip law at constant normal stress."""
    return Scene(normal_stress="constant")


@pytest.fixture
def variable() -> Scene:
    """Slip law with all effects of variable normal stress."""
    return Scene(normal_stress="variable", alpha=0.56, phi=60.0)


@pytest.fixture(scope="session")
def cluster():
    """A Dask client of two worker processes."""
    from rsfstudy import workers

    with workers.local_cluster(2) as client:
        yield client
