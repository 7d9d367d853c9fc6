"""Tests of motions that continue from the end of another motion.

The result must equal an uninterrupted motion.
"""

import numpy as np
import pytest
import xarray as xr

from rsfstudy import Scene, history, protocol, simulate
from rsfstudy.errors import InvalidValue
from rsfstudy.motion.engines import COMPILED, ENGINE_NAMES

PLAIN = {"normal_stress": "constant", "a": 0.01, "b_over_a": 1.4, "law": "slowness"}
IMPOSED = PLAIN | {"normal_stress": "imposed"}
RECORD = history({"time": np.linspace(0.0, 20.0, 41),
                  "velocity": 1.0 + 0.5 * np.sin(np.linspace(0.0, 20.0, 41)),
                  "normal_stress": 1.0 + 0.1 * np.cos(np.linspace(0.0, 20.0, 41))})  # fmt: skip
STEPS = protocol([{"velocity": 2.0, "duration": 4.0}, {"velocity": 0.0, "duration": 3.0},
                  {"velocity": 1.0, "step": 0.1, "duration": 5.0}, {"velocity": 3.0}])  # fmt: skip
SCENES = {
    "two states": Scene(
        **{k: v for k, v in PLAIN.items() if k not in ("law", "b_over_a")}, law="two_slip_states",
        b1_over_a=1.2, b2_over_a=0.2, length_ratio=3.0, stiffness=0.01, load_velocity_ratio=2.0,
    ),
    "mass": Scene(**PLAIN, stiffness_ratio=0.6, inertia=True, period=1e7, load_velocity_ratio=2.0),
    "dilatant": Scene(**PLAIN, fluid="dilatant", stiffness=0.01, load_velocity_ratio=2.0),
    "protocol": Scene(**PLAIN, stiffness=0.01, loading=STEPS),
    "record": Scene(**IMPOSED, stiffness=0.01, loading=RECORD),
    "ramp": Scene(**IMPOSED, stiffness=0.01, normal_stress_ramp=0.2, ramp_duration=8.0),
    "oscillation": Scene(**IMPOSED, stiffness=0.01, oscillation_amplitude=0.1),
    "train": Scene(**IMPOSED, stiffness=0.01, oscillation_amplitude=0.05, oscillation_begin=3.0,
                   oscillation_period=8.0, oscillation_cycles=1.1, oscillation_phase=30.0),
    "train of the load point": Scene(
        **PLAIN, stiffness=0.01, velocity_oscillation=0.05, oscillation_begin=3.0,
        oscillation_period=8.0, oscillation_cycles=1.1, oscillation_phase=30.0,
    ),
}  # fmt: skip
WHAT = ["shear_stress", "log10_slip_rate", "slip", "state_variable", "load_point_displacement"]


@pytest.mark.parametrize("engine", ENGINE_NAMES)
@pytest.mark.parametrize("name", SCENES)
def test_a_cut_changes_nothing(name, engine, tmp_path):
    """A motion can be interrupted anywhere and stored in a file.

    The interruptions are within segments, at their ends and at samples. Limit cycles
    amplify the error.
    """
    scene, how = SCENES[name], {"rtol": 1e-9, "engine": engine}
    whole = simulate(scene, times=[15.0], **how)
    part, file = None, tmp_path / "part.nc"
    for end in (0.7, 4.0, 7.0, 7.5):
        part = simulate(scene, duration=end if part is None else end - float(part.time[-1]),
                        start=part, **how)  # fmt: skip
        assert float(part.time[-1]) == pytest.approx(end, rel=1e-15)
        part.to_netcdf(file)
        part = xr.load_dataset(file)
    rest = simulate(scene, times=[15.0], start=part, **how)
    for which in WHAT:
        np.testing.assert_allclose(rest[which], whole[which], atol=2e-6, rtol=1e-7)


def test_a_cut_in_a_rupture_keeps_its_momentum():
    scene, how = SCENES["mass"], {"rtol": 1e-9, "engine": COMPILED}
    motion = simulate(scene, duration=60.0, **how)
    inertial = motion.regime.values == motion.regime.flag_meanings.split().index("inertial")
    fastest = motion.isel(time=inertial).log10_slip_rate.idxmax("time")
    first = simulate(scene, duration=float(fastest), **how)
    rest = simulate(scene, times=[60.0], start=first, **how)
    for which in ("shear_stress", "slip"):
        assert float(rest[which][-1]) == pytest.approx(float(motion[which][-1]), rel=1e-5)


def test_what_has_no_end_is_refused():
    scene = SCENES["dilatant"]
    motion = simulate(scene, duration=1.0, engine=COMPILED)
    with pytest.raises(InvalidValue, match="must be the scene of the motion"):
        simulate(SCENES["mass"], duration=1.0, start=motion)
    with pytest.raises(InvalidValue, match="must be a complete motion"):
        simulate(scene, duration=1.0, start=motion.drop_attrs())
    with pytest.raises(InvalidValue, match="increasing finite numbers that begins at 1 or later"):
        simulate(scene, times=[0.5, 2.0], start=motion)
