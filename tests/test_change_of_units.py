"""Tests of the invariance of dimensionless numbers under changes of units.

Unit conversions are rounded once, so equal values have equal bits, and equal scenes have
equal results.
"""

from fractions import Fraction

import numpy as np
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from study_runs import run

import rsfstudy
from rsfstudy import Rig, Study
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.rig.units import compute_conversion_factor

NAMES = {
    "Pa": ("Pa", "kPa", "MPa", "GPa", "bar", "N/m^2", "N/cm^2"),
    "m": ("m", "cm", "mm", "um", "nm"),
    "s": ("s", "ms", "min", "h"),
}
#: All units of each kind of quantity.
UNITS = NAMES | {
    "m/s": tuple(f"{x}/{t}" for x in NAMES["m"] for t in NAMES["s"]),
    "Pa/m": tuple(f"{s}/{x}" for s in NAMES["Pa"][:5] for x in NAMES["m"]),
}
RIG = {
    "normal_stress": ("5e6", "Pa"),
    "slip_distance": ("1e-5", "m"),
    "reference_velocity": ("1e-6", "m/s"),
    "stiffness": ("1e9", "Pa/m"),
    "period": ("0.02", "s"),
}
PLAIN = Rig(**{name: float(size) for name, (size, _kind) in RIG.items()})
FRICTION = {"law": "slowness", "a": 0.01, "b_over_a": 1.5}
HOW = {"engine": "compiled", "rtol": 1e-5}
few = settings(max_examples=12)


def stated(size, kind):
    """Return a strategy for a quantity in various units.

    Only units in which a float represents the value exactly are used.
    """

    def text(unit):
        value = Fraction(size) / compute_conversion_factor("x", unit, kind)
        return f"{float(value)!r} {unit}" if Fraction(repr(float(value))) == value else None

    return st.sampled_from([text(unit) for unit in UNITS[kind] if text(unit)])


def rigs(*names):
    texts = {name: stated(*RIG[name]) for name in names or RIG}
    return st.fixed_dictionaries(texts).map(lambda given: Rig(**given))


def same(found: xr.Dataset, known: xr.Dataset) -> None:
    for name, values in known.data_vars.items():
        if name not in ("wall_time", "message"):
            np.testing.assert_array_equal(found[name].values, values.values, err_msg=str(name))


def cycles(rig, stresses, velocities):
    study = Study(
        name="cycles", title="Cycles", rig=rig, base=rig.scene(**FRICTION),
        axes=[rig.axis("normal_stress", stresses), rig.axis("load_velocity", velocities)],
        measure=LimitCycle(phases=3),
    )  # fmt: skip
    return run(study, **HOW)


@few
@given(
    rigs(),
    st.tuples(stated("4e6", "Pa"), stated("2e7", "Pa")),
    st.tuples(stated("3e-6", "m/s"), stated("1e-4", "m/s")),
)
def test_of_cycles_of_a_rig(rig, stresses, velocities):
    same(cycles(rig, stresses, velocities), cycles(PLAIN, [4e6, 2e7], [3e-6, 1e-4]))


@few
@given(rigs(), stated("3e9", "Pa/m"))
def test_of_critical_steps(rig, stiffness):
    fields = FRICTION | {"law": "slip", "inertia": False, "instability_norm": 1e3}
    found, known = (
        rsfstudy.critical_step(of.scene(**fields, stiffness=k), of="displacement_step", **HOW)
        for of, k in ((rig, stiffness), (PLAIN, 3e9))
    )
    assert found.attrs["status"] == "ok"
    same(found, known)


@few
@given(
    rigs(), stated("2e10", "Pa/m"), stated("1e-5", "m/s"), stated("30", "s"), stated("2e-4", "m")
)
def test_of_motions(rig, stiffness, velocity, duration, distance):
    def motion(rig, stiffness, velocity, duration, distance):
        steps = [{"velocity": velocity, "duration": duration}, {"velocity": 0.0, "duration": 60.0},
                 {"velocity": 1e-6, "distance": distance}]  # fmt: skip
        scene = rig.scene(
            **FRICTION, inertia=False, stiffness=stiffness, loading=rig.protocol(steps)
        )
        return rsfstudy.simulate(scene, **HOW)

    found = motion(rig, stiffness, velocity, duration, distance)
    assert found.sizes["time"] > 20
    same(found, motion(PLAIN, 2e10, 1e-5, 30.0, 2e-4))
