"""Tests of the scenes and the representation of a rig."""

import pytest
from study_runs import call_main

import rsfstudy
from rsfstudy import Rig
from rsfstudy.errors import InvalidValue

QUANTITIES = {
    "normal_stress": "8 MPa",
    "slip_distance": "12.5 um",
    "reference_velocity": "0.3 um/s",
    "stiffness": "0.05 MPa/um",
}


def test_a_scene_accepts_b():
    rig = Rig(**QUANTITIES)
    scene = rig.scene(a=0.01, b=0.013)
    assert scene == rig.scene(a=0.01, b_over_a=0.013 / 0.01)
    assert scene.b == pytest.approx(0.013, rel=1e-15)
    assert "b" in rig.scene.__signature__.parameters


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"b": 0.013}, "b = 0.013 requires a, because scenes contain b/a. Pass a as well"),
        ({"a": 0.01, "b": 0.013, "b_over_a": 1.3}, "cannot be combined with b_over_a"),
        ({"a": 0.01, "b": "5 MPa"}, "'b' must be a number without units"),
        ({"a": 0.01, "b": "large"}, "is not a quantity"),
    ],
)
def test_values_of_b_are_checked(fields, message):
    with pytest.raises(InvalidValue, match=message):
        Rig(**QUANTITIES).scene(**fields)


def test_a_rig_is_shown_with_units_and_without_omitted_quantities():
    rig = Rig(**QUANTITIES)
    assert repr(rig) == (
        "Rig(normal_stress='8 MPa', slip_distance='12.5 um', reference_velocity='0.3 um/s', "
        "stiffness='0.05 MPa/um')"
    )
    assert eval(repr(rig), {"Rig": Rig}) == rig
    heat = {"shear_modulus": 3e10, "density": 2700.0}
    assert repr(Rig(**QUANTITIES, **heat)).endswith("density='2700 kg/m^3')")


def test_the_default_friction_is_reported(tmp_path):
    rig = Rig(**QUANTITIES)
    texts = []
    for fields in ("a=0.01", "mu_star=0.6"):
        options = [f"--{name.replace('_', '-')}={text}" for name, text in QUANTITIES.items()]
        options += ["--set", fields, "--set", "hold_time=10 s", "--duration", "10 s"]
        ran = call_main("simulate", *options, "--output", tmp_path / "motion.png")
        assert ran.returncode == 0, ran.stderr
        texts.append(" ".join(ran.stdout.split()))
    assert "friction coefficient at V_*, has its default value 0.76" in texts[0]
    assert "default value" not in texts[1]
    assert rig.scene(a=0.01).mu_star == rsfstudy.Scene().mu_star


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("mass", "20 kg", r"mass per fault area, not a mass \(got '20 kg'\).*'1e4 kg/m\^2'"),
        ("normal_stress", "20 kN", "a stress, not a force.*Divide the force by the fault area"),
        ("stiffness", "20 kN/mm", "a stress divided by a displacement, not a force.*'0.04 MPa/um'"),
    ],
)
def test_values_must_be_divided_by_the_fault_area(name, value, message):
    rig = {"normal_stress": "5 MPa", "slip_distance": "10 um", "reference_velocity": "1 um/s"}
    with pytest.raises(InvalidValue, match=message):
        Rig(**{**rig, "stiffness": "0.04 MPa/um", name: value})
