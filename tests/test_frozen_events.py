"""All engines tell what they told when `frozen_events.json` was written: a change of code that is
not to change numbers changes none. `python tests/frozen_motion_comparison.py freeze` writes the
file anew, after a change that is to.
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
from rsfstudy.motion.engines import ENGINES
from rsfstudy.motion.events import EventKind
from rsfstudy.slider.part_registry import SLOTS

#: What numbers may differ by, relative to what `telling.largest_differences` says. Last bits are
#: another CPU's own (its exponentials, the order of its sums, whether it fuses multiplication and
#: addition): by `frozen_motion_comparison.py sensitivity` none of them moves an event by more than
#: a tenth of this, a root that ends an iteration earlier included.
WITHIN = 1e-12
#: The same where steps end. A step is as long as its error estimate says, which is a difference of
#: slopes: rounding is 1e-9 of it where it just meets a tolerance of 7e-9.
OF_STEPS = 1e-8
#: Right-hand sides may differ by a share, and by what one more step and its root take.
OF_WORK, MORE_WORK = 0.03, 30

with FROZEN_EVENTS_FILE.open() as file:
    KEPT = json.load(file)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", MOTIONS)
def test_events_are_as_they_were(name, engine):
    now, kept = record_frozen_motion(MOTIONS[name], engine), KEPT[name]
    assert now.kinds == kept["kinds"]
    # plain Python takes the compiled steps
    work = kept["work"].get(engine, kept["work"]["compiled"])
    then = EventColumns(kept["kinds"], kept["numbers"], work, now.step_rows)
    motion, of_steps = largest_differences(MOTIONS[name], then, now)
    assert motion < WITHIN
    assert of_steps < OF_STEPS
    assert now.work[-1:] == pytest.approx(then.work, rel=OF_WORK, abs=MORE_WORK)


def test_what_is_kept_is_all_there_is():
    """Every part in every slot, every kind of event; in a file that is small."""
    assert set(KEPT) == set(MOTIONS)
    parts = {type(p) for motion in MOTIONS.values() for p in Scene(**motion.fields).parts}
    assert parts >= {part for slot in SLOTS for part in slot.built_in_parts.values()}
    assert {text.split()[0] for kept in KEPT.values() for text in kept["kinds"]} >= set(EventKind)
    assert FROZEN_EVENTS_FILE.stat().st_size < 300 * 1024


@pytest.mark.parametrize("engine", ENGINES)
def test_what_moves_is_seen(engine):
    """A field of which the tenth digit is another, in one of the least sensitive motions."""
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
