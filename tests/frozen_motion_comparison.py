"""Recording of frozen motions, and comparison of two recordings.

Usage::

    python tests/frozen_motion_comparison.py freeze          # overwrite frozen_events.json
    python tests/frozen_motion_comparison.py sensitivity     # effect of rounding errors on events
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
from rsfstudy.motion.integration_events import EventKind
from rsfstudy.motion.work_meter import MotionStopped
from rsfstudy.slider.motion_point import MotionPoint

FROZEN_EVENTS_FILE = Path(__file__).with_name("frozen_events.json")

#: Fields of a point, except the state variables.
POINT_FIELDS = tuple(name for name in MotionPoint._fields if name != "psis")


class EventColumns(NamedTuple):
    """Event table of a motion, stored in columns.

    Attributes
    ----------
    kinds : list of str
        Event kind, requested quantity and level, and regime of each event. If the motion stops
        early, the last entry is its status.
    numbers : dict of str to list of float
        Time, slip, and the fields of the points; NaN where a value is not available.
    work : list of int
        Cumulative number of right-hand-side evaluations at each event.
    step_rows : list of int
        Rows of events that are located at the end of a step, such as a settled slip or the end of a
        rupture. These events depend on the step sizes, so rounding errors move them by as much as
        the local error changes. The list also contains the rows in which a rupture begins, because
        the derivative of ln V is a difference quotient there, with few significant digits.
    """

    kinds: list[str]
    numbers: dict[str, list[float]]
    work: list[int]
    step_rows: list[int]


def record_frozen_motion(
    motion: Motion | Track, engine: str, scene: Scene | None = None
) -> EventColumns:
    """Return the events of a motion as computed by one engine.

    If ``scene`` is given, it replaces the scene of the motion.
    """
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
    loose = [
        i for i, e in enumerate(events) if e.kind in (EventKind.SETTLED, EventKind.REGIME_CHANGE)
    ]
    return EventColumns(kinds, numbers, [event.evaluation_count for event in events], loose)


def number_scale(name: str, a: float) -> float:
    """Return the change of a quantity that corresponds to 1 in ln V."""
    return 1.0 if name in ("time", "slip", "log_slip_rate", "log_slip_rate_derivative") else a


def largest_differences(
    motion: Motion | Track, reference: EventColumns, other: EventColumns
) -> tuple[float, float]:
    """Return the largest relative differences between two recordings.

    The first value covers all rows except the step rows, and the second value covers the
    step rows. Both are infinite if the event kinds or the columns differ.

    Differences are relative to the largest magnitude of the quantity along the motion, with
    the change that corresponds to 1 in ln V as a lower bound, because integration and
    rounding errors accumulate in these units. Errors of times and slips are proportional to
    the elapsed time and slip. Stresses and states are sums of large terms that cancel, so
    values near zero are as uncertain as their neighbours.
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
    """Write the SciPy events of all frozen motions, and the work counts."""
    frozen = {}
    for name, motion in MOTIONS.items():
        found, other = (record_frozen_motion(motion, engine) for engine in (SCIPY, COMPILED))
        work = {"scipy": found.work[-1:], "compiled": other.work[-1:]}
        frozen[name] = {"kinds": found.kinds, "work": work, "numbers": found.numbers}
    lines = ",\n".join(f"{json.dumps(name)}: {json.dumps(it)}" for name, it in frozen.items())
    FROZEN_EVENTS_FILE.write_text(f"{{\n{lines}\n}}\n")


def sensitivity(draws: int = 20, last_bit: float = 2.3e-16) -> None:
    """Print the change of all events caused by rounding errors.

    The last bit of every field is changed at random.
    """
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
