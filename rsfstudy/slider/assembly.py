"""Plain functions of floats, put together for the parts of a scene.

A part calls other parts by the names in `slots`, and reads its numbers at ``p[OWN]``. Here copies
of its functions are made in which those names stand for the functions of the other parts, and OWN
for the place of its numbers. No function holds a number of a scene: the same ones serve every scene
of the same parts.
"""

from __future__ import annotations

import math
import types
from collections.abc import Iterable, Mapping
from functools import cache, reduce
from typing import TYPE_CHECKING, Any

from rsfstudy.slider import forms, friction, saturated, states
from rsfstudy.slider.parts import Function, Numbers
from rsfstudy.slider.slots import FIRST_OWN

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
    law = scene.parts.law
    of_friction, of_load = (scene.a, scene.b, scene.mu_star), (load_velocity, log_load_rate)
    of_law = law.stress_dependence, scene.a * law.size_over_a
    common = *of_friction, stiffness, *of_load, *of_law, scene.imposed_normal_stress
    own = (value for part in _with_numbers(scene) for value in part.numbers(scene))
    return (*common, *own)


def functions(scene: Scene, dynamics: Dynamics | None = None) -> Functions:
    """The functions of a scene by their names in `slots`, with other dynamics than its own where
    some are given.
    """
    law, stress, pressing, own = _with_numbers(scene)
    acting = own if dynamics is None else dynamics
    begin, starts = FIRST_OWN, []
    for part in (law, stress, pressing, own):
        starts.append(begin)
        begin += len(part.numbers(scene))
    return _assembled(
        (
            law.states,
            tuple(getattr(law, name) for name in _OF_LAW),
            law.state_effect,
            friction.stress_dependence if law.stress_dependence else None,
            law.regularised,
            starts[0],
        ),
        (stress.normal_stress, stress.state_effect, starts[1]),
        (len(pressing.unknowns), *(getattr(pressing, name) for name in _OF_FLUID), starts[2]),
        pressing is scene.parts.fluid,
        (*(getattr(acting, name) for name in _OF_DYNAMICS), starts[3]),
    )


_OF_LAW = ("evolution", "evolutions", "resting")
_OF_FLUID = ("seepage", "seeped")
_OF_DYNAMICS = ("balance", "growth", "rupture_rate", "rupture_point")


def _with_numbers(scene: Scene) -> tuple[Any, Any, Any, Any]:
    parts = scene.parts
    return parts.law, parts.normal_stress, scene.pressing, parts.dynamics


@cache
def _assembled(
    law: tuple[Any, ...],
    stress: tuple[Any, ...],
    fluid: tuple[Any, ...],
    inside: bool,
    dynamics: tuple[Any, ...],
) -> Functions:
    """The functions of a combination of parts; the same ones whenever it is asked for."""
    count, of_law, law_effect, dependence, reverses, law_own = law
    effects = [(stress[1], stress[2]), (law_effect, law_own), (dependence, law_own)]
    filled = _of_law(count, of_law, law_own) | _of_stress(stress[0], stress[2], effects)
    if reverses:
        filled["strength"] = bound(friction.reversible, one_way=filled["strength"])
    dry = filled
    if fluid[0]:
        filled = filled | _of_fluid(filled, count, *fluid)
    # a rig knows of what a loading does to normal stress, and not of pressure inside the fault
    outer = dry if inside else filled
    filled["outer_stress"] = outer["effective_stress"]
    filled["outer_stress_change"] = outer["effective_stress_change"]
    filled["states_at"] = bound(states.states_at, **filled)
    filled["moved"] = _moved(filled["STATES"])
    filled["pace"] = forms.pace
    filled["reading_growth"] = bound(forms.reading_growth, **filled)
    filled["point_at"] = bound(forms.point_at, **filled)
    *supplied, own = dynamics
    for name, function in zip(_OF_DYNAMICS, supplied, strict=True):
        if function is not None:
            filled[name] = of_part(function, own, **filled)
    for name in ("point", "point_in_rupture", "rigid_rate", "rigid_point"):
        filled[name] = bound(getattr(forms, name), **filled)
    return types.MappingProxyType({**filled, **_along_path(filled, reverses=reverses)})


def _along_path(known: Mapping[str, Any], *, reverses: bool) -> dict[str, Function]:
    """The rates of all unknowns along the path, and against displacement."""
    made, count = dict[str, Function](), known["BEYOND"]
    for name, form, unknowns in (
        ("rate", forms.by_displacement, count),
        ("rate_with_time", forms.by_displacement_with_time, count + 1),
    ):
        by = bound(form, **known)
        if reverses:
            by = bound(forms.by_displacement_either_way, **{**known, "changes": by})
        filled = {**known, "changes": by, "scaled": _scaled(unknowns)}
        made[form.__name__], made[name] = by, bound(forms.along_path, **filled)
    for name, form, unknowns in (
        ("full_rate", forms.rupture_along_path, count + 1),
        ("full_rate_with_time", forms.rupture_along_path_with_time, count + 2),
    ):
        made[name] = bound(form, **{**known, "scaled": _scaled(unknowns)})
    return made


def _of_law(count: int, of_law: tuple[Any, ...], own: int) -> dict[str, Any]:
    """How the states of a law evolve, and add up."""
    filled = _places(count)
    for name, function in zip(_OF_LAW, of_law, strict=True):
        if function is not None:
            filled[name] = of_part(function, own)
    for name, usual in (("evolutions", "evolutions_of_one"), ("resting", "resting_of_one")):
        filled.setdefault(name, bound(getattr(forms, usual), **filled))
    alone = count == 1 and of_law[0] is not None
    filled["total"] = states.only if alone else states.total
    filled["felt"] = states.felt_of_one if alone else states.felt
    return filled


def _places(states: int) -> dict[str, Any]:
    """Where the unknowns of so many states are (see `forms`)."""
    return {"STATES": states, "BEYOND": 1 + states, "BEYOND_FULL": 2 + states}


def _of_stress(
    normal_stress: Any, own: int, state_effects: Iterable[tuple[Any, int]]
) -> dict[str, Any]:
    """The friction relation, with the effects of stress on the state."""
    filled: dict[str, Any] = {}
    if normal_stress is not None:
        filled["normal_stress"] = of_part(normal_stress, own)
    effects = [of_part(effect, place) for effect, place in state_effects if effect is not None]
    if effects:
        filled["state_effect"] = reduce(_both, effects)
    coupled = "coupled" if normal_stress is not None else "plain"
    form = f"{coupled}_with_state_effect" if effects else coupled
    filled["strength"] = bound(getattr(friction, form), **filled)
    filled.setdefault("normal_stress", forms.unchanged_normal_stress)
    filled["effective_stress"] = bound(forms.normal_stress_alone, **filled)
    filled["effective_stress_change"] = bound(forms.normal_stress_change, **filled)
    return filled


def _moved(count: int) -> Function:
    """What moves so many states."""
    one: Function = states.only_moved
    return one if count == 1 else bound(states.moved, others_moved=_moved(count - 1))


@cache
def _scaled(count: int) -> Function:
    """What scales so many numbers."""
    one: Function = states.only_scaled
    return one if count == 1 else bound(states.scaled, others_scaled=_scaled(count - 1))


def _both(effect: Function, other: Function) -> Function:
    """Two effects of stress on the state as one."""
    return bound(friction.both_state_effects, state_effect=effect, other_state_effect=other)


def _of_fluid(
    known: Mapping[str, Any], of_law: int, count: int, seepage: Any, seeped: Any, own: int
) -> dict[str, Any]:
    """What a fluid, or a loading that goes on changing normal stress, puts in the place of
    functions of law and stress, of which it makes use.
    """
    filled = {
        **known,
        **_places(of_law + count),
        "OF_LAW": of_law,
        "evolutions_of_law": known["evolutions"],
        "resting_of_law": known["resting"],
        "seepage": of_part(seepage, own),
        "seeped": of_part(seeped, own),
    }
    if known["total"] is not states.only:
        filled["total"] = bound(saturated.total, **filled)
    filled["effective_stress"] = bound(saturated.less_pressure, **filled)
    filled["effective_stress_change"] = bound(saturated.less_pressure_change, **filled)
    effect = "_with_state_effect" if "state_effect" in known else ""
    filled["strength"] = bound(getattr(saturated, f"strength{effect}"), **filled)
    by_pressure = getattr(saturated, f"by_pressure{effect}")
    filled["strength_of_pressure"] = bound(by_pressure, **filled)
    for name in ("felt", "evolutions", "resting"):
        filled[name] = bound(getattr(saturated, name), **filled)
    return filled


def bound(function: Function, **names: Any) -> Function:
    """A copy of a plain function in which some global names stand for something else."""
    assert isinstance(function, types.FunctionType)
    copy = types.FunctionType(
        function.__code__, {**function.__globals__, **names}, function.__name__
    )
    copy.__doc__ = function.__doc__
    return copy


def of_part(function: Function, own: int, **names: Any) -> Function:
    """A function of a part whose numbers begin at `own`, with the other plain functions of its
    file.
    """
    assert isinstance(function, types.FunctionType)
    names["OWN"] = own
    beside = {
        name: bound(value)
        for name, value in function.__globals__.items()
        if isinstance(value, types.FunctionType)
        and value.__module__ == function.__module__
        and value.__closure__ is None
    }
    known = {**beside, **names}
    for copy in beside.values():
        copy.__globals__.update(known)
    return bound(function, **known)
