"""What the frozen motions tell, in columns, and how far two tellings are apart.

python tests/frozen_motion_comparison.py freeze          # writes frozen_events.json anew
python tests/frozen_motion_comparison.py sensitivity     # what a last bit does to the frozen events
"""

from __future__ import annotations

import itertools
import json
import math
import random
import sys
from pathlib import Path
from typing import NamedTuple

from frozen_scenes import MOTIONS, Motion, Track

from rsfstudy import Scene
from rsfstudy.motion.engines import COMPILED, SCIPY
from rsfstudy.motion.events import EventKind
from rsfstudy.motion.work_meter import MotionStopped
from rsfstudy.slider.motion_point import MotionPoint

FROZEN_EVENTS_FILE = Path(__file__).with_name("frozen_events.json")

#: Numbers of a point that are no states.
POINT_FIELDS = tuple(name for name in MotionPoint._fields if name != "psis")


class EventColumns(NamedTuple):
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
    step_rows: list[int]


def record_frozen_motion(
    motion: Motion | Track, engine: str, scene: Scene | None = None
) -> EventColumns:
    """What an engine tells of a motion, or of another scene in its place."""
    scene = Scene(**motion.fields) if scene is None else scene
    events, kinds = [], list[str]()
    try:
        for event in itertools.islice(motion.events(scene, engine), motion.rows):
            events.append(event)
            asked = (
                ()
                if event.specification is None
                else (event.specification.quantity, f"{event.specification.level:.6g}")
            )
            kinds.append(" ".join((event.kind, *asked, event.regime)))
    except MotionStopped as halt:
        kinds.append(halt.status.label)
    numbers = {
        "time": [event.time for event in events],
        "slip": [event.slip for event in events],
        **{name: [getattr(event.point, name) for event in events] for name in POINT_FIELDS},
    }
    for i in range(max((len(event.point.psis) for event in events), default=0)):
        numbers[f"psi_{i + 1}"] = [(*event.point.psis, *[math.nan] * 4)[i] for event in events]
    loose = [i for i, e in enumerate(events) if e.kind in (EventKind.SETTLED, EventKind.REGIME)]
    return EventColumns(kinds, numbers, [event.evaluations for event in events], loose)


def number_scale(name: str, a: float) -> float:
    """The change of a number that weighs as much as one of 1 in ln V."""
    return 1.0 if name in ("time", "slip", "log_slip_rate", "log_slip_rate_derivative") else a


def largest_differences(
    motion: Motion | Track, reference: EventColumns, other: EventColumns
) -> tuple[float, float]:
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
        scale = max([number_scale(name, motion.fields["a"]), *known])
        for row, (x, y) in enumerate(zip(values, other.numbers[name], strict=True)):
            if x != y and not (math.isnan(x) and math.isnan(y)):
                off = abs(x - y) / scale
                off, of_step = off if math.isfinite(off) else math.inf, row in reference.step_rows
                worst[of_step] = max(worst[of_step], off)
    return worst[0], worst[1]


def write_frozen_events() -> None:
    """Write the events of all frozen scenes, by SciPy, and the work of both engines."""
    frozen = {}
    for name, motion in MOTIONS.items():
        found, other = (record_frozen_motion(motion, engine) for engine in (SCIPY, COMPILED))
        work = {"scipy": found.work[-1:], "compiled": other.work[-1:]}
        frozen[name] = {"kinds": found.kinds, "work": work, "numbers": found.numbers}
    lines = ",\n".join(f"{json.dumps(name)}: {json.dumps(it)}" for name, it in frozen.items())
    FROZEN_EVENTS_FILE.write_text(f"{{\n{lines}\n}}\n")


def sensitivity(draws: int = 20, last_bit: float = 2.3e-16) -> None:
    """Print how far events move, and those of steps, with a last bit of all fields."""
    chance = random.Random(1)
    for name, motion in MOTIONS.items():
        reference = record_frozen_motion(motion, SCIPY)
        fields = {"mu_star": 0.76, **motion.fields}
        numbers = [n for n, value in fields.items() if type(value) is float]
        off = [largest_differences(motion, reference, record_frozen_motion(motion, COMPILED))]
        for _ in range(draws):
            moved = {n: fields[n] * (1.0 + chance.choice((-1, 0, 1)) * last_bit) for n in numbers}
            scene = Scene(**fields | moved)
            off += [
                largest_differences(motion, reference, record_frozen_motion(motion, by, scene))
                for by in (SCIPY, COMPILED)
            ]
        print(f"{name:50}", *(f"{max(each):.1e}" for each in zip(*off, strict=True)))


if __name__ == "__main__":
    {"freeze": write_frozen_events, "sensitivity": sensitivity}[sys.argv[1]]()
