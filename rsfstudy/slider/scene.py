"""The Scene: which slider. Five parts and the numbers every slider has, checked when made."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import FrozenInstanceError
from functools import cached_property, partial
from typing import Any, Never, NoReturn

from rsfstudy.errors import InvalidValue
from rsfstudy.slider import loading, places, stability, system
from rsfstudy.slider.dynamics.quasi_static import QuasiStatic
from rsfstudy.slider.fields import (
    SLOT_NAMES,
    SLOTS,
    Layout,
    chosen,
    layout_of,
    refuse_unless_idle,
    unknown_field,
    unnamed,
    without_meaning,
)
from rsfstudy.slider.following import Following, Parts
from rsfstudy.slider.loading.step import Step
from rsfstudy.slider.numbers import SPRING, with_spring
from rsfstudy.slider.parts import Numbers, Part, checked, copier


class Scene(Following):
    """A spring-slider with rate- and state-dependent friction, sliding steadily at V_* until a step
    is imposed.

    Immutable and checked: a scene that exists is meaningful. Quantities are dimensionless, with
    stress in sigma_*, slip in D_c, time in D_c/V_* and slip rate in V_*.

    Parameters
    ----------
    law : str or type
        State evolution law: "slip" (default), "slowness" or any other file of
        `rsfstudy.slider.laws`, or a class of your own, whose fields are then fields of the scene.
    law_exponent : float, optional
        Exponent of the family of laws, from 0 (slip law) to 1 (slowness law); 0.5.
    cutoff_velocity_ratio : float, optional
        V_c/V_*, above which contact no longer heals by the composite law, and the evolution effect
        is left behind by the law with a cut-off; 100.
    stress_dependence : float
        c of Nagata et al. (2012): shear stress lowers the state variable by c dtau/sigma; 0.
    normal_stress : {"constant", "imposed", "variable"}, or type
        Constant; what the loading imposes; or coupled to shear stress by a driving stress inclined
        at `phi`; or a class of your own.
    fluid : {"drained", "dilatant"}, or type
        Pore pressure that never changes, or that falls where pores open with slip rate; or a class
        of your own. Stress is in units of the effective normal stress of steady sliding at V_*, so
        that pore pressure is counted from that of the surroundings, where it begins.
    dynamics, loading : type, optional
        A class of your own in these slots, which other fields fill without it.
    alpha : float, optional
        Strength of the normal stress effect on the state variable (not at constant normal stress;
        0.56). Zero leaves the effect out.
    phi : float, optional
        Angle in degrees between the driving stress and the fault normal (variable normal stress
        only; 60).
    dilatancy, drainage : float, optional
        eps/(beta sigma_*), by which undrained pore pressure falls for each unit of ln V, and rate
        c* D_c/V_* at which it drains (dilatant fluid only; 0.01 and 1).
    a, b_over_a : float
        Direct effect, and evolution effect over direct effect. Rate weakening is b > a; without it
        there is no critical stiffness, and `stiffness` must be given.
    regularised : bool
        Whether slip reverses with shear stress (arcsinh form; quasi-static motion only).
    b1_over_a, b2_over_a, length_ratio : float, optional
        The same for each of two states (laws of two states only, instead of `b_over_a`), and the
        slip distance of the second over D_c, which is that of the first. Negative b are allowed.
    mu_star : float
        Steady-state friction coefficient at V_*.
    stiffness_ratio : float, optional
        Stiffness over the critical stiffness at V_* without radiation damping. Above it steady
        sliding is stable; with damping also a little below. Default: 1. With several states a ratio
        below 1 need not be unstable.
    stiffness : float, optional
        Stiffness itself, k D_c/sigma_*, instead of its ratio.
    load_velocity_ratio : float, optional
        Load point velocity over V_* after the step. Default: 1, or 0 after a step of displacement
        or of normal stress.
    displacement_step : float
        Instantaneous displacement of the load point in D_c.
    normal_stress_step : float
        Sudden change of imposed normal stress over sigma_* (not at constant normal stress); that of
        sigma_3 where a driving stress is inclined.
    oscillation_amplitude, oscillation_period : float
        Amplitude over sigma_*, and period in D_c/V_*, of an oscillation of imposed normal stress
        that begins as sin(t) under a load point at `load_velocity_ratio` (not at constant normal
        stress; that of sigma_3 where a driving stress is inclined). Zero is none.
    normal_stress_ramp, ramp_duration : float
        Change of imposed normal stress over sigma_* at a steady rate, and time in D_c/V_* that it
        takes, under a load point at `load_velocity_ratio` (not at constant normal stress; that of
        sigma_3 where a driving stress is inclined). Zero is none.
    hold_time : float
        Time in D_c/V_* for which the load point is held, before it moves on at
        `load_velocity_ratio`. Zero is no hold.
    velocity_steps, velocity_ratio, displacement_between_steps : float
        How many steps of load point velocity there are, from V_* to `velocity_ratio` V_* and back
        in turn, and how far in D_c it moves from one to the next (10; 20). Zero is no step.
    velocity_ramp, velocity_ramp_duration, velocity_ramp_stairs : float
        Change of load point velocity over V_* at a steady rate, time in D_c/V_* that it takes, and
        number of stairs that stand for it (10; 64). Zero is none.
    inertia : bool
        Whether the slider has mass.
    radiation_damping : float
        eta V_*/sigma_*: stress that waves carry away at V_* (quasi-dynamic motion, instead of
        mass); T V_*/(2 pi D_c) times the stiffness is the impedance of spring and mass.
    period : float
        Period of free oscillation T in s; with `reference_rate` it sets inertia and the instability
        norm.
    reference_rate : float
        V_*/D_c in 1/s.
    instability_norm : float
        A motion counts as unstable once V T/(2 pi D_c) reaches this norm.
    initial_stress, initial_state : float
        Shear stress over sigma_* above that of steady sliding at V_*, and state variable Theta,
        with which the slider begins, before the first step. Zero: it slides steadily at V_*.

    Attributes
    ----------
    parts : Parts
        What fills the slots: ``law``, ``normal_stress``, ``fluid``, ``dynamics`` and ``loading``.

    Raises
    ------
    InvalidValue
        For a value that is wrong or means nothing, with the rule it breaks and the remedy.
    """

    _slider: Part
    _layout: Layout
    #: What scenes share that differ in the spring and the loading alone.
    _known_of_friction: dict[str, float]

    def __init__(self, *nameless: Never, **given: Any) -> None:
        if nameless:
            raise unnamed(nameless[0])
        layout = layout_of(tuple(chosen(slot, given) for slot in SLOTS))
        own: tuple[dict[str, Any], ...] = tuple({} for _part in layout.parts)
        for name, value in given.items():
            if name not in layout.fields and name not in SLOT_NAMES:
                raise unknown_field(name, value, layout)
            if value is None or name in SLOT_NAMES:
                continue
            place = layout.places.get(name)
            if place is None:
                refuse_unless_idle(name, value, layout.refusing[name])
            else:
                own[place][name] = checked(layout.parts[place], name, value)
        own[0].update(with_spring(own[0]))
        made = [part(**values) for part, values in zip(layout.parts, own, strict=True)]
        self._fill(layout, made)

    def _fill(self, layout: Layout, made: Sequence[Part]) -> None:
        """Take the fields from the parts, and let the parts say whether they go together."""
        slider, *parts = made
        self.__dict__.update(layout.elsewhere, _layout=layout, _slider=slider)
        self.__dict__["_known_of_friction"] = {}
        self.__dict__["parts"] = Parts(*parts)  # type: ignore[arg-type]
        for part in (slider, *parts):
            self.__dict__.update(part.__dict__)
        self._check()

    def _check(self) -> None:
        """The law last: it may ask what all of friction makes of steady sliding."""
        for part in reversed(self.every_part):
            part.check(self)

    def __setattr__(self, name: str, value: Any) -> NoReturn:
        raise FrozenInstanceError(f"cannot assign to field {name!r}")

    def __delattr__(self, name: str) -> NoReturn:
        raise FrozenInstanceError(f"cannot delete field {name!r}")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Scene) and self._what_it_is() == other._what_it_is()

    def __hash__(self) -> int:
        return hash(self._what_it_is())

    def _what_it_is(self) -> tuple[object, ...]:
        """Its fields, and its parts of the user's own: a name may stand for several."""
        return *self.as_dict().values(), *(part.what_it_is() for part in self.own_parts)

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(Scene, **{**self.as_dict(), **self._layout.own}), ()

    @property
    def every_part(self) -> tuple[Part, ...]:
        """The law, the numbers that every slider has, and the other parts."""
        return self.parts.law, self._slider, *self.parts[1:]

    def without_mass(self) -> Scene:
        """The same slider in quasi-static motion, if it has mass."""
        if not self.has_mass:
            return self
        return self._with_parts(self.parts._replace(dynamics=QuasiStatic()))

    @cached_property
    def critical_stiffness(self) -> float:
        """k_cr(V_*) D_c/sigma_*, without mass or damping, and before anything changes normal stress
        (see `stability.critical_stiffness`).
        """
        known = self._known_of_friction
        if "critical_stiffness" not in known:
            unloaded = self.parts._replace(loading=Step())
            before = self._with_parts(unloaded) if self._is_changed else self
            found = stability.critical_stiffness(before, 0.0, quasi_static=True)
            known["critical_stiffness"] = found
        return known["critical_stiffness"]

    @property
    def _is_changed(self) -> bool:
        """Whether friction is another than before the loading."""
        return self.imposed_normal_stress != 0.0 or bool(self.parts.loading.unknowns)

    @cached_property
    def made(self) -> dict[tuple[Any, ...], Any]:
        """What others make of it once and for all."""
        return {}

    @cached_property
    def numbers(self) -> Numbers:
        """All numbers, as the functions of the equations read them (see `places`)."""
        return places.numbers(self)

    @cached_property
    def numbers_of_friction(self) -> Numbers:
        """The same for functions that friction alone decides."""
        return places.numbers_of_friction(self)

    @cached_property
    def functions(self) -> system.System:
        """The functions of the equations, by name (see `system`)."""
        return system.functions(self)

    @property
    def unforced(self) -> Scene:
        """The same slider under a load point that moves steadily, where its loading goes on
        changing normal stress: what steady sliding and its stability are asked of.
        """
        if not self.parts.loading.unknowns:
            return self
        return self.under(loading.Segment(self.load_velocity))

    @property
    def segments(self) -> tuple[tuple[Scene, float], ...]:
        """The scene as each segment of its loading has it, and for how long, in D_c/V_*."""
        history = self.parts.loading.segments
        if len(history) == 1:
            return ((self, history[0].duration),)
        acting = [self.under(segment) for segment in history]
        if self.parts.loading.unknowns:
            acting[0] = self
        return tuple((scene, s.duration) for scene, s in zip(acting, history, strict=True))

    def under(self, segment: loading.Segment) -> Scene:
        """The same slider, loaded by one segment."""
        step = Step(
            load_velocity_ratio=segment.load_velocity,
            displacement_step=segment.displacement,
            normal_stress_step=segment.normal_stress,
        )
        scene = self._with_parts(self.parts._replace(loading=step))
        scene.__dict__["_known_of_friction"] = self._known_of_friction
        if not self.parts.loading.unknowns:
            scene.__dict__["functions"] = self.functions
        return scene

    def _with_parts(self, parts: Parts) -> Scene:
        """A copy with other parts in the slots."""
        scene = Scene.__new__(Scene)
        scene._fill(layout_of(tuple(type(part) for part in parts)), [self._slider, *parts])
        return scene

    def with_(self, **changes: Any) -> Scene:
        """A copy with some fields changed, checked anew.

        Changing what fills a slot drops the fields that have no meaning any more; stiffness takes
        the place of its ratio, and the other way round.
        """
        plain = self._layout.plain
        if all(name in plain and value is not None for name, value in changes.items()):
            return self._with_numbers(changes)
        kept = {**self.as_dict(), **self._layout.own}
        for name in without_meaning({**kept, **changes}, self._layout.own.values()):
            kept.pop(name, None)
        if any(changes.get(name) is not None for name in SPRING):
            kept |= dict.fromkeys(SPRING)
        return Scene(**kept | changes)

    def _with_numbers(self, changes: Mapping[str, Any]) -> Scene:
        """A copy with the same parts, of which those that change are made and checked anew."""
        layout, values = self._layout, list[Any]()
        for name, value in changes.items():
            place = layout.places.get(name)
            if place is None:
                raise layout.refusing[name].refuse(name, value)
            values.append(checked(layout.parts[place], name, value))
        (scene,) = self.varied(tuple(changes), [values])
        scene._check()
        return scene

    def varied(self, names: Sequence[str], rows: Iterable[Sequence[Any]]) -> Iterator[Scene]:
        """Copies with other numbers in fields of its parts, which must have been checked.

        Parameters
        ----------
        names : sequence of str
            The fields, each one of a part that this scene has.
        rows : iterable of sequence of float
            Their values in each copy.
        """
        kept, copiers = self._copying(tuple(names))
        parts = self._slider, *self.parts
        others = {name for name in names if self._layout.places[name] != len(parts) - 1}
        if not others and "functions" in self.__dict__:
            kept = {**kept, "functions": self.functions}
        known = self._known_of_friction if others <= {*SPRING} else None
        for row in rows:
            scene, made = Scene.__new__(Scene), list(parts)
            scene.__dict__.update(kept, _known_of_friction={} if known is None else known)
            for place, copy, own in copiers:
                made[place] = copy({name: row[i] for name, i in own})
                scene.__dict__.update(made[place].__dict__)
            scene.__dict__["_slider"], scene.__dict__["parts"] = made[0], Parts._make(made[1:])
            yield scene

    def _copying(self, names: tuple[str, ...]) -> tuple[dict[str, Any], list[tuple[Any, ...]]]:
        """What copies with other numbers in these fields share; and where the parts are that have
        them, what copies those, and which of the fields they have. Found once.
        """
        key = "copying", *names
        if key not in self.made:
            layout, parts = self._layout, (self._slider, *self.parts)
            kept = {**layout.elsewhere, "_layout": layout, "_slider": self._slider}
            copiers = []
            for place, part in enumerate(parts):
                kept |= part.__dict__
                own = [(name, i) for i, name in enumerate(names) if layout.places[name] == place]
                copiers += [(place, copier(part), own)] if own else []
            self.made[key] = kept, copiers
        found: tuple[dict[str, Any], list[tuple[Any, ...]]] = self.made[key]
        return found

    def as_dict(self) -> dict[str, Any]:
        """The fields as plain Python values."""
        return {name: self.__dict__[name] for name in self._layout.fields}

    def describe(self) -> dict[str, Any]:
        """The same, and the segments of a loading of the user's own, as `protocol` takes them."""
        stated = self.parts.loading.stated if "loading" in self._layout.own else ()
        return self.as_dict() | ({"segments": [s.as_dict() for s in stated]} if stated else {})

    def owner(self, name: str) -> type[Part] | None:
        """The kind of its part that owns a field, if one does."""
        place = self._layout.places.get(name)
        return None if place is None else self._layout.parts[place]

    @property
    def combination(self) -> int:
        """Number of its combination of parts, in this process."""
        return id(self._layout)

    @property
    def own_parts(self) -> tuple[type[Part], ...]:
        """Those of its parts that are the user's own."""
        return tuple(self._layout.own.values())


def check_scene(value: object) -> None:
    """Refuse what is no scene."""
    if not isinstance(value, Scene):
        remedy = "Make one, rsfstudy.Scene(...); rsfstudy.run computes studies."
        raise InvalidValue("scene", value, "is no scene", remedy=remedy)
