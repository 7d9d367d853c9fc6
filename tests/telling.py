"""What a work tree tells of itself: the events of frozen scenes, samples of motions, what results
files hold, and the numbers of named studies. `gate.py` compares two trees by it.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from frozen_scenes import MOTIONS, Motion, Track

import rsfstudy
from rsfstudy import Axis, Scene, simulate
from rsfstudy.errors import RsfStudyError
from rsfstudy.motion.events import Kind

try:
    from rsfstudy.motion.meter import Halt
except ImportError:  # in a tree of before
    from rsfstudy.motion.stepping import Halt
from rsfstudy.slider.point import Point

#: Numbers of a point that are no states.
NUMBERS = tuple(name for name in Point._fields if name != "psis")
#: Motions that are followed by `simulate` too, for all their rows.
SIMULATED = (
    *("slip", "two slowness states", "cut_off, dilatant", "perrin_rice_zheng, damped"),
    *("slowness, mass", "slip, mass, dilatant", "slip, stress dependence", "slip, reversed"),
    *("slip, hold", "family, velocity steps", "perrin_rice_zheng, protocol", "slip, oscillation"),
)
#: Studies that measure time.
TIMED = ("accuracy_cost", "effects")
#: Attributes of files that are of a run, of which there only has to be one.
OF_A_RUN = ("history", "date_created", "provenance", "digests", "digest")


# ---- events --------------------------------------------------------------------------------------


class Told(NamedTuple):
    """What a motion tells, in columns.

    Attributes
    ----------
    kinds : list of str
        Of each event: kind, what was asked for, and regime; and the status where it cannot go on.
    numbers : dict of str to list of float
        Time, slip, and the numbers of its points; NaN where there is none.
    work : list of int
        Right-hand sides spent so far.
    loose : list of int
        Rows told where a step happens to end, which rounding moves by as much as it is of the local
        error: slip has settled, a rupture is over. And those where one begins: how fast ln V grows
        by the full equations is the quotient of a difference of which few digits are left.
    """

    kinds: list[str]
    numbers: dict[str, list[float]]
    work: list[int]
    loose: list[int]


def told(motion: Motion | Track, engine: str, scene: Scene | None = None) -> Told:
    """What an engine tells of a motion, or of another scene in its place."""
    scene = Scene(**motion.fields) if scene is None else scene
    events, kinds = [], list[str]()
    try:
        for event in itertools.islice(motion.events(scene, engine), motion.rows):
            events.append(event)
            asked = () if event.watch is None else (event.watch.of, f"{event.watch.level:.6g}")
            # a tree of before says sample
            kind = "sampled" if event.kind == "sample" else event.kind
            kinds.append(" ".join((kind, *asked, event.regime)))
    except Halt as halt:
        kinds.append(halt.status.label)
    numbers = {
        "time": [event.time for event in events],
        "slip": [event.slip for event in events],
        **{name: [getattr(event.point, name) for event in events] for name in NUMBERS},
    }
    for i in range(max((len(event.point.psis) for event in events), default=0)):
        numbers[f"psi_{i + 1}"] = [(*event.point.psis, *[math.nan] * 4)[i] for event in events]
    loose = [i for i, e in enumerate(events) if e.kind in (Kind.SETTLED, Kind.REGIME)]
    return Told(kinds, numbers, [event.work for event in events], loose)


def unit_of(name: str, a: float) -> float:
    """The change of a number that weighs as much as one of 1 in ln V."""
    return 1.0 if name in ("time", "slip", "log_slip_rate", "growth") else a


def apart(motion: Motion | Track, reference: Told, other: Told) -> tuple[float, float]:
    """The largest relative differences between what is told of a motion, in all rows but those of
    steps, and in those; infinite where something else is told.

    Differences are relative to the largest magnitude of a number along the motion, and at least to
    the change that weighs as much as one of 1 in ln V: errors of integration, and rounding, add up
    in these units. Those of times and slips are in proportion to what has passed, and stresses and
    states are sums in which terms of the largest magnitude cancel, so that a number near zero is as
    uncertain as its neighbours.
    """
    if other.kinds != reference.kinds or other.numbers.keys() != reference.numbers.keys():
        return math.inf, math.inf
    worst = [0.0, 0.0]
    for name, values in reference.numbers.items():
        known = (abs(value) for value in values if math.isfinite(value))
        scale = max([unit_of(name, motion.fields["a"]), *known])
        for row, (x, y) in enumerate(zip(values, other.numbers[name], strict=True)):
            if x != y and not (math.isnan(x) and math.isnan(y)):
                off = abs(x - y) / scale
                off, of_step = off if math.isfinite(off) else math.inf, row in reference.loose
                worst[of_step] = max(worst[of_step], off)
    return worst[0], worst[1]


# ---- all that it tells ---------------------------------------------------------------------------


@dataclass
class Answers:
    """What a tree tells: texts, and lists of numbers with the least that they are relative to; both
    by group and label.
    """

    texts: dict[str, dict[str, Any]] = field(default_factory=dict)
    numbers: dict[str, dict[str, tuple[float, list[float]]]] = field(default_factory=dict)

    def text(self, group: str, label: str, text: Any) -> None:
        """Take in a text, or what JSON can hold."""
        self.texts.setdefault(group, {})[label] = text

    def number(self, group: str, label: str, values: Any, least: float = 0.0) -> None:
        """Take in numbers."""
        flat = np.asarray(values, dtype=float).ravel().tolist()
        self.numbers.setdefault(group, {})[label] = (least, flat)


def tell_events(answers: Answers, engine: str) -> None:
    """The events of all frozen scenes."""
    for name, motion in MOTIONS.items():
        try:
            found = told(motion, engine)
        except Exception as error:  # the other motions are to be told of all the same
            answers.text(f"events {engine}", name, repr(error))
            continue
        answers.text(f"events {engine}", name, found.kinds)
        for of, values in found.numbers.items():
            least, label = unit_of(of, motion.fields["a"]), f"{name} / {of}"
            # relative to all rows, those of steps too
            least = max([least, *(abs(value) for value in values if math.isfinite(value))])
            for group, loose in (("events", False), ("steps", True)):
                rows = [v for i, v in enumerate(values) if (i in found.loose) is loose]
                if rows:
                    answers.number(f"{group} {engine}", label, rows, least)
        answers.number(f"work {engine}", name, found.work[-1:])


def tell_samples(answers: Answers, engine: str) -> None:
    """All variables of some trajectories."""
    for name in SIMULATED:
        motion = MOTIONS[name]
        how = {"duration": min(motion.until, 30.0), "rtol": motion.rtol, "engine": engine}
        try:
            ran = simulate(Scene(**motion.fields), **how)
        except Exception as error:
            answers.text(f"samples {engine}", name, repr(error))
            continue
        for of, values in ran.reset_coords().variables.items():
            answers.number(f"samples {engine}", f"{name} / {of}", values)
        answers.text(f"samples {engine}", name, ran.attrs["status"])


def tell_files(answers: Answers, folder: Path) -> None:
    """Variables and attributes of a file of each measure: that of a named study, of which two
    points of each axis are enough, loosely computed.
    """
    seen = set[str]()
    for name, study in rsfstudy.studies().items():
        if study.measure.name in seen:
            continue
        seen.add(study.measure.name)
        axes = []
        for axis in study.axes:
            rows = axis.rows[:2]
            if axis.labels is not None:
                values = dict(zip(axis.labels, rows, strict=False))
            else:  # values of the axis itself, or numbered points
                values = {name: [row[name] for row in rows] for name in rows[0]}
                values = values.get(axis.dimension, values)
            axes.append(Axis(axis.dimension, values))
        small = replace(study, axes=axes, reductions=(), claims=())
        small = replace(small, accuracy=replace(small.accuracy, rtol=1e-3, budget=5_000))
        how = {"workers": 0, "progress": False, "fresh": True, "keep_going": True}
        rsfstudy.run(small, output=folder, **how)
        tell_file(answers, study.measure.name, folder / f"{name}.nc")


def tell_file(answers: Answers, label: str, file: Path) -> None:
    """What a file says of itself and of its variables."""
    with xr.open_dataset(file, decode_cf=False) as raw:
        attributes = {n: "" if n in OF_A_RUN else str(v) for n, v in raw.attrs.items()}
        answers.text("files", label, attributes)
        for name, variable in raw.variables.items():
            about = {n: np.asarray(v).tolist() for n, v in variable.attrs.items()}
            # texts are as long as the longest of them
            kind = variable.dtype.str if variable.dtype.kind in "iufb" else "text"
            said = {"dims": list(variable.dims), "dtype": kind, **about}
            answers.text("files", f"{label} / {name}", repr(said))


def tell_studies(answers: Answers, folder: Path, engine: str, only: list[str]) -> None:
    """All numbers and statuses of named studies, and what their files say."""
    for name in [name for name in rsfstudy.studies() if name in (only or rsfstudy.studies())]:
        if name in TIMED:
            continue
        how = {"workers": 2, "progress": False, "fresh": True, "engine": engine}
        try:
            ran = rsfstudy.run(name, output=folder, **how).load()
        except RsfStudyError as error:
            answers.text(f"studies {engine}", name, repr(error))
            continue
        tell_file(answers, f"study {name}", folder / f"{name}.nc")
        answers.text(f"studies {engine}", name, ran["status"].values.ravel().tolist())
        for of, values in ran.data_vars.items():
            if values.dtype.kind not in "iuf" or values.attrs.get("units") == "s":
                continue
            group = "work" if of in ("rhs_evaluations", "work_per_cycle") else "studies"
            about = ran.get(of.removesuffix("_error"), values).values
            least = float(np.abs(about[np.isfinite(about)]).max(initial=0.0))
            answers.number(f"{group} {engine}", f"{name} / {of}", values, least)
