"""Tests of all engines against the events in ``frozen_events.json``.

Changes of the code must not change the events unless they are meant to change numbers.
After such a change, run ``python tests/frozen_motion_comparison.py freeze`` to update the
file.
"""

import json

import pytest
from frozen_motion_comparison import (
    FROZEN_EVENTS_FILE,
    EventColumns,
    largest_differences,
    record_frozen_motion,
)
from frozen_scenes import MOTIONS

from rsfstudy import Scene
from rsfstudy.motion.engines import ENGINE_NAMES
from rsfstudy.motion.integration_events import EventKind
from rsfstudy.slider.part_registry import PART_SLOTS

#: Tolerance of the differences from ``frozen_motion_comparison.largest_differences``. The last
#: bits depend on the CPU, for example on its exponentials, the order of sums, and fused
#: multiplication and addition. According to ``frozen_motion_comparison.py sensitivity``, these
#: effects move an event by at most a tenth of the tolerance, even if a root search ends one
#: iteration earlier.
WITHIN = 1e-12
#: Tolerance of events at the end of steps. The step size depends on an error estimate, which is
#: a difference of slopes. If this estimate is close to a tolerance of 7e-9, its rounding error
#: is about 1e-9 of the estimate.
OF_STEPS = 1e-8
#: Tolerance of the number of evaluations, which may differ by a fraction, and by an additional
#: step with a root search.
OF_WORK, MORE_WORK = 0.03, 30

with FROZEN_EVENTS_FILE.open() as file:
    KEPT = json.load(file)


@pytest.mark.parametrize("engine", ENGINE_NAMES)
@pytest.mark.parametrize("name", MOTIONS)
def test_events_are_as_they_were(name, engine):
    now, kept = record_frozen_motion(MOTIONS[name], engine), KEPT[name]
    assert now.kinds == kept["kinds"]
    # The engine ``python`` takes the same steps as the compiled engine.
    work = kept["work"].get(engine, kept["work"]["compiled"])
    then = EventColumns(kept["kinds"], kept["numbers"], work, now.step_rows)
    motion, of_steps = largest_differences(MOTIONS[name], then, now)
    assert motion < WITHIN
    assert of_steps < OF_STEPS
    assert now.work[-1:] == pytest.approx(then.work, rel=OF_WORK, abs=MORE_WORK)


def test_what_is_kept_is_all_there_is():
    """The small file covers every part and every kind of event."""
    assert set(KEPT) == set(MOTIONS)
    parts = {type(p) for motion in MOTIONS.values() for p in Scene(**motion.fields).parts}
    assert parts >= {part for slot in PART_SLOTS for part in slot.built_in_parts.values()}
    assert {text.split()[0] for kept in KEPT.values() for text in kept["kinds"]} >= set(EventKind)
    assert FROZEN_EVENTS_FILE.stat().st_size < 300 * 1024


@pytest.mark.parametrize("engine", ENGINE_NAMES)
def test_what_moves_is_seen(engine):
    """A relative change of 1e-10 of a field is detected.

    The motion is one of the least sensitive motions.
    """
    motion = MOTIONS["slowness, displacement step, mass"]
    scene = Scene(**motion.fields, mu_star=0.76 * (1.0 + 1e-10))
    assert (
        largest_differences(
            motion,
            record_frozen_motion(motion, engine),
            record_frozen_motion(motion, engine, scene),
        )[0]
        > WITHIN
    )
