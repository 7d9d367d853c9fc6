"""Plain functions of floats, put together for the parts of a scene.

A part calls other parts by the names in `slots`, and reads its numbers at ``p[OWN]``. Here copies
of its functions are made in which those names stand for the functions of the other parts, and OWN
for the place of its numbers. No function holds a number of a scene: the same ones serve every scene
of the same parts.
"""

from __future__ import annotations

import math
import types
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from rsfstudy.slider import forms, friction
from rsfstudy.slider.parts import Function, Numbers
from rsfstudy.slider.slots import FIRST_OWN
from rsfstudy.slider.states import only

if TYPE_CHECKING:
    from rsfstudy.slider.dynamics import Dynamics
    from rsfstudy.slider.scene import Scene

Functions = Mapping[str, Function]


def numbers(scene: Scene) -> Numbers:
    """The numbers of a scene as its functions read them.

    Those that every scene has come first, as in `slots`; then those of each part.
    """
    return _numbers(scene, scene.stiffness, scene.load_velocity, scene.log_load_rate)


def numbers_of_friction(scene: Scene) -> Numbers:
    """The same for functions that friction alone decides: no spring, and no load point."""
    return _numbers(scene, math.nan, math.nan, math.nan)


def _numbers(scene: Scene, stiffness: float, load_velocity: float, log_load_rate: float) -> Numbers:
    common = scene.a, scene.b, scene.mu_star, stiffness, load_velocity, log_load_rate
    own = (value for part in _with_numbers(scene) for value in part.numbers(scene))
    return (*common, *own)


def functions(scene: Scene, dynamics: Dynamics | None = None) -> Functions:
    """The functions of a scene by their names in `slots`, with other dynamics than its own where
    some are given.
    """
    law, stress, own = _with_numbers(scene)
    acting = own if dynamics is None else dynamics
    begin, starts = FIRST_OWN, []
    for part in (law, stress, own):
        starts.append(begin)
        begin += len(part.numbers(scene))
    return _assembled(
        (law.states, tuple(getattr(law, name) for name in _OF_LAW), law.state_effect, starts[0]),
        (stress.normal_stress, stress.state_effect, starts[1]),
        (*(getattr(acting, name) for name in _OF_DYNAMICS), starts[2]),
    )


_OF_LAW = ("evolution", "evolutions", "resting")
_OF_DYNAMICS = ("balance", "growth", "rupture_rate", "rupture_point")


def _with_numbers(scene: Scene) -> tuple[Any, Any, Any]:
    return scene.parts.law, scene.parts.normal_stress, scene.parts.dynamics


@cache
def _assembled(
    law: tuple[Any, ...], stress: tuple[Any, ...], dynamics: tuple[Any, ...]
) -> Functions:
    """The functions of a combination of parts; the same ones whenever it is asked for."""
    states, of_law, law_effect, law_own = law
    normal_stress, stress_effect, stress_own = stress
    filled: dict[str, Any] = {"STATES": states, "BEYOND": 1 + states}
    for name, function in zip(_OF_LAW, of_law, strict=True):
        if function is not None:
            filled[name] = of_part(function, law_own)
    for name, usual in (("evolutions", "evolutions_of_one"), ("resting", "resting_of_one")):
        filled.setdefault(name, bound(getattr(forms, usual), **filled))
    if normal_stress is not None:
        filled["normal_stress"] = of_part(normal_stress, stress_own)
    effects = [
        of_part(effect, own)
        for effect, own in ((stress_effect, stress_own), (law_effect, law_own))
        if effect is not None
    ]
    filled |= dict(zip(("state_effect", "other_state_effect"), effects, strict=False))
    if len(effects) > 1:
        filled["state_effect"] = bound(friction.both_state_effects, **filled)
    coupled = "coupled" if normal_stress is not None else "plain"
    form = f"{coupled}_with_state_effect" if effects else coupled
    filled["strength"] = bound(getattr(friction, form), **filled)
    if normal_stress is None:
        filled["normal_stress"] = forms.unchanged_normal_stress
    alone = states == 1 and of_law[0] is not None
    if alone:
        filled["total"] = only
    filled["evolving"] = bound(forms.evolving_alone if alone else forms.evolving, **filled)
    filled["point_at"] = bound(forms.point_at, **filled)
    *supplied, own = dynamics
    for name, function in zip(_OF_DYNAMICS, supplied, strict=True):
        if function is not None:
            filled[name] = of_part(function, own, **filled)
    for name in ("rate", "rate_with_time", "point", "rigid_rate", "rigid_point"):
        filled[name] = bound(getattr(forms, name), **filled)
    return types.MappingProxyType(filled)


def bound(function: Function, **names: Any) -> Function:
    """A copy of a plain function in which some global names stand for something else."""
    assert isinstance(function, types.FunctionType)
    copy = types.FunctionType(
        function.__code__, {**function.__globals__, **names}, function.__name__
    )
    copy.__doc__ = function.__doc__
    return copy


def of_part(function: Function, own: int, **names: Any) -> Function:
    """A function of a part whose numbers begin at `own`, with the other functions of its file."""
    assert isinstance(function, types.FunctionType)
    names["OWN"] = own
    beside = {
        name: bound(value, **names)
        for name, value in function.__globals__.items()
        if isinstance(value, types.FunctionType) and value.__module__ == function.__module__
    }
    return bound(function, **{**beside, **names})
