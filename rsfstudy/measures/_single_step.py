"""What is asked of one step, after which a motion decides."""

from __future__ import annotations

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.scene import Scene


def check_single_step(scene: Scene) -> None:
    """Refuse a loading of several segments."""
    loading = scene.parts.loading
    if len(loading.segments) > 1:
        rule = "is no single step, after which a motion decides"
        remedy = "Read its peaks by step_response, or by simulate."
        raise InvalidValue("loading", loading.name, rule, remedy=remedy)
