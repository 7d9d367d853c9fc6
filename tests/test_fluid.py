"""Tests of pore pressure.

Dilatancy with drainage is compared with the closed forms of Segall and Rice (1995). Steady
sliding, its stability and motions must use the same friction relation.
"""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator
from test_steady import PLAIN

import rsfstudy
from rsfstudy import Scene, simulate
from rsfstudy.errors import InvalidValue
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import ENGINE_NAMES
from rsfstudy.motion.integration_events import EventKind, maximum
from rsfstudy.motion.integrator import Integrator
from rsfstudy.motion.recording import FIRST_STATE_COLUMN, RECORDED_VARIABLE_NAMES, MotionRecorder
from rsfstudy.responses.step_response import StepResponse
from rsfstudy.slider import stability
from rsfstudy.slider.equations import (
    build_equations_at_imposed_slip_rate,
)
from rsfstudy.slider.fluid import Fluid
from rsfstudy.slider.fluid.dilatant import DilatantFluid
from rsfstudy.slider.parameter_layout import FLUID
from rsfstudy.slider.parts import number

LAWS = PLAIN
CONSTANT = {"normal_stress": "constant"}
STRESS = [CONSTANT, {"alpha": 0.0}, {"alpha": 0.56}]


def dilatant(dilatancy: float = 0.005, drainage: float = 1.0, **fields) -> Scene:
    return Scene(fluid="dilatant", dilatancy=dilatancy, drainage=drainage, **fields)


# ---- critical stiffness --------------------------------------------------------------------------


def closed_form(a: float, b: float, weakening: float, drainage: float) -> float:
    """Return the critical stiffness in closed form.

    The stiffness is the larger root K of [K + a (1 + c) - b + E] [K (1 + c) - c (b - a)] =
    a c K.
    """
    c = drainage
    offset = a * (1.0 + c) - b + weakening
    linear = (1.0 + c) * offset - c * (b - a) - a * c
    constant = -c * (b - a) * offset
    root = math.sqrt(linear**2 - 4.0 * (1.0 + c) * constant)
    return 0.5 * (root - linear) / (1.0 + c)


@given(
    st.floats(0.003, 0.02),
    st.floats(1.1, 4.0),
    st.floats(0.0, 0.9),
    st.floats(-4.0, 4.0),
    st.floats(-5.0, 5.0),
    st.sampled_from(LAWS),
)
def test_critical_stiffness_is_the_closed_form(a, b_over_a, part, log_drainage, log_slip_rate, law):
    """The critical stiffness agrees with the closed form to 1e-11 unless drainage is fast.

    E is up to 90 % of b - a at V_*. The drainage ratio c decreases with slip rate.
    """
    b, drainage = a * b_over_a, 10.0**log_drainage
    scene = dilatant(
        part * (b - a) / 0.76, drainage, law=law, a=a, b_over_a=b_over_a, stiffness=0.1, **CONSTANT
    )
    weakening = (0.76 + (a - b) * log_slip_rate) * scene.dilatancy
    assume(weakening < 0.95 * (b - a))
    drainage_ratio = drainage * math.exp(-log_slip_rate)
    exact = closed_form(a, b, weakening, drainage_ratio)
    ours = stability.compute_critical_stiffness(scene, log_slip_rate)
    # The error of 1,500 random scenes is at most 1e-12 up to a drainage ratio of 100. If drainage
    # is faster, roots of polynomials lose digits in proportion to the ratio, up to 1.2e-8.
    assert ours == pytest.approx(exact, rel=min(1e-11 + 1e-12 * drainage_ratio, 5e-8))


def compaction_polynomial(scene: Scene, stiffness: float) -> np.ndarray:
    """Return the growth rates p at V_* from the characteristic polynomial.

    The polynomial is K (p + 1)(p + r)(p + c) + p {[a (p + 1) - b](p + r)(p + c) + E r p (p + 1)},
    where r is the inverse of the porosity length and E is mu_* times the dilatancy.
    """
    p = np.polynomial.Polynomial([0.0, 1.0])
    r, c, effect = 1.0 / scene.porosity_length, scene.drainage, scene.mu_star * scene.dilatancy
    friction = (scene.a * (p + 1.0) - scene.b) * (p + r) * (p + c) + effect * r * p * (p + 1.0)
    return (stiffness * (p + 1.0) * (p + r) * (p + c) + p * friction).roots()


@given(
    st.floats(-0.02, 0.006),
    st.floats(-2.0, 2.0),
    st.floats(-2.0, 1.0),
    st.sampled_from(LAWS),
)
def test_growth_rates_with_a_porosity_length(dilatancy, log_length, log_drainage, law):
    """The growth rates are the roots of the characteristic polynomial.

    At the critical stiffness, the largest real part of the roots changes sign.
    """
    scene = dilatant(
        dilatancy, 10.0**log_drainage, porosity_length=10.0**log_length,
        law=law, a=0.01, b_over_a=1.5, mu_star=0.6, stiffness=0.01, **CONSTANT,
    )  # fmt: skip
    critical = scene.critical_stiffness
    assert 0.0 < critical < math.inf
    for ratio in (0.98, 1.02):
        exact = compaction_polynomial(scene, ratio * critical)
        ours = stability.compute_linear_growth_rates(scene.with_(stiffness=ratio * critical), 0.0)
        assert bool(exact.real.max() > 0.0) is (ratio < 1.0)
        # The roots of a polynomial lose digits if two roots are close to each other.
        assert ours.real.max() == pytest.approx(exact.real.max(), rel=1e-5, abs=1e-9)


@pytest.mark.parametrize(
    ("dilatancy", "rate", "drainage", "stiffness"),
    [
        (0.002, 1.0, 0.1, 0.0030672500594662),
        (0.002, 0.1, 0.1, 0.0047332168863169),
        (0.002, 10.0, 1.0, 0.0049183074200377),
        (-0.002, 1.0, 1.0, 0.0057943617196895),
        (-0.002, 0.1, 0.1, 0.0052638880796745),
    ],
)
def test_critical_stiffness_with_a_porosity_length(dilatancy, rate, drainage, stiffness):
    """Dilatancy lowers the critical stiffness, and compaction raises it.

    The values are the stiffness at which roots of the characteristic polynomial are
    imaginary. Without a fluid, the critical stiffness is 0.005. ``dilatancy`` is multiplied by
    mu_*, and ``rate`` is the inverse of the porosity length.
    """
    scene = dilatant(
        dilatancy / 0.6, drainage, porosity_length=1.0 / rate,
        a=0.01, b_over_a=1.5, mu_star=0.6, **CONSTANT,
    )  # fmt: skip
    assert scene.critical_stiffness == pytest.approx(stiffness, rel=1e-13)


def test_a_porosity_length_of_one_changes_no_bit():
    """If the porosity length is D_c, the rates agree with Segall and Rice (1995)."""
    plain, longer = dilatant(0.004, 0.3), dilatant(0.004, 0.3, porosity_length=2.0)
    assert dilatant(0.004, 0.3, porosity_length=1.0) == plain
    assert math.isnan(plain.parameter_values[FLUID + 2])
    for x, porosity, pressure, slip in np.random.default_rng(58).normal(size=(100, 4)).tolist():
        opening, drains = slip * (0.004 * x - porosity), -0.3 * (slip * math.exp(-x)) * pressure
        for scene, opened in ((plain, opening), (longer, 0.5 * opening)):
            rates = scene.parts.fluid.auxiliary_rates
            found = rates(x, (porosity, pressure), slip, scene.parameter_values)
            assert found == (opened, drains - opened)


def test_a_porosity_length_needs_a_constant_pressure_around_the_fault():
    """The parameters of the fluid and of the loading share the same places."""
    pressure = rsfstudy.history({"time": [0.0, 1.0, 2.0], "pore_pressure": [0.0, 0.01, 0.02]})
    imposed = {"normal_stress": "imposed", "loading": pressure}
    assert dilatant(**imposed).state_count == 4
    with pytest.raises(InvalidValue, match=r"porosity_length must be 1 if the loading"):
        dilatant(**imposed, porosity_length=2.0)


def leaking(log_slip_rate, states, share, p):
    return share * (p[FLUID] * log_slip_rate - states[0]), -share * p[FLUID + 2] * states[1]


@dataclass(frozen=True, kw_only=True)
class Leaking(DilatantFluid):
    """User-defined fluid that derives from the dilatant fluid and has another parameter."""

    leak: float = number(0.3, "", "1", "leak per slip")

    name = "leaking"
    auxiliary_rates = staticmethod(leaking)


def test_a_derived_fluid_keeps_the_places_of_its_parameters():
    """The field of the base class is rejected, because other rates do not read it."""
    scene = Scene(fluid=Leaking, dilatancy=0.004, leak=0.7, **CONSTANT)
    assert scene.parameter_values[FLUID : FLUID + 3] == (0.004, 1.0, 0.7)
    assert scene.parts.fluid.auxiliary_rates is leaking
    with pytest.raises(InvalidValue, match="has no effect on the rates of the fluid 'leaking'"):
        scene.with_(porosity_length=2.0)


@pytest.mark.parametrize("length", [0.0, -1.0])
def test_a_porosity_length_must_be_positive(length):
    with pytest.raises(InvalidValue, match="porosity_length must be greater than 0"):
        dilatant(porosity_length=length)


@pytest.mark.parametrize("dilatancy", [0.02, -0.02])
def test_a_frozen_porosity_has_no_effect(dilatancy):
    """The limit of a very long porosity length is a drained fault."""
    fields = {"a": 0.01, "stiffness": 0.03, "load_velocity_ratio": 3.0, **CONSTANT}
    frozen = simulate(dilatant(dilatancy, 1.0, porosity_length=1e9, **fields), duration=5.0)
    drained = simulate(Scene(**fields), times=frozen.time.values)
    np.testing.assert_allclose(frozen.log10_slip_rate, drained.log10_slip_rate, atol=1e-6)
    assert float(abs(frozen.porosity).max()) < 1e-9


# ---- the relation and the equations --------------------------------------------------------------


@pytest.mark.parametrize("rate", [0.1, 20.0])
@pytest.mark.parametrize("drainage", [1e-9, 0.5, 30.0])
@pytest.mark.parametrize(("dilatancy", "length"), [(0.01, 1.0), (0.01, 0.3), (-0.01, 4.0)])
def test_a_rigid_slider_after_a_step_of_its_slip_rate(rate, drainage, dilatancy, length):
    """Porosity, pressure and stress agree with closed forms.

    The closed forms are phi = E ln V [1 - exp(-r s)] and P = -r E ln V [exp(-r s) - exp(-c
    s)]/(c - r), where c is the ratio of drainage to slip rate and r is the inverse of the porosity
    length. The stress is friction times 1 - P, with the closed form for the slip law.
    """
    scene = dilatant(
        dilatancy, drainage, porosity_length=length, load_velocity_ratio=rate, **CONSTANT
    )
    r = 1.0 / length
    x, c, start = math.log(rate), drainage / rate, scene.a * math.log(rate)
    recording = MotionRecorder(sample_times=np.array([0.1, 0.7, 2.0, 5.0]))
    equations = build_equations_at_imposed_slip_rate(scene, x)
    path = Integrator(Accuracy()).follow_equations(
        equations, (start, 0.0, 0.0), local_tolerance=1e-11, recording=recording
    )
    next(event for event in path if event.kind is EventKind.ALL_SAMPLES_RECORDED)
    for row, asked in zip(recording.as_table(scene), recording.sample_times, strict=True):
        slip, friction = (
            row[RECORDED_VARIABLE_NAMES.index("slip")],
            row[RECORDED_VARIABLE_NAMES.index("frictional_stress")] - 0.76,
        )
        porosity, pressure = row[FIRST_STATE_COLUMN + 1 :]
        assert slip == asked
        assert porosity == pytest.approx(dilatancy * x * -math.expm1(-r * slip), abs=1e-11)
        exact = -r * dilatancy * x * (math.exp(-r * slip) - math.exp(-c * slip)) / (c - r)
        assert pressure == pytest.approx(exact, abs=1e-10)
        coefficient = 0.76 + scene.a * x + scene.b * x * math.expm1(-slip)
        stress = (1.0 - exact) * coefficient - 0.76
        # The tolerance per step is 1e-11 times a, and the errors of hundreds of steps
        # accumulate.
        assert friction == pytest.approx(stress, abs=1e-10)
        ratio = row[RECORDED_VARIABLE_NAMES.index("normal_stress_ratio")]
        assert ratio == pytest.approx(1.0 - exact, abs=1e-10)
        point = equations.evaluate_motion_point((friction, porosity, pressure))
        assert point.friction_coefficient == pytest.approx(coefficient, abs=1e-10)


@pytest.mark.parametrize(
    "fields",
    [
        {"stiffness_ratio": 3.0},
        {"stiffness_ratio": 0.3, "inertia": True},
        {"stiffness_ratio": 0.3, "radiation_damping": 1e-4},
    ],
)
def test_without_drainage_pressure_is_lost_to_porosity(fields):
    """Without drainage, P = -(phi - phi_0)/beta in every regime."""
    scene, far = dilatant(0.01, 1e-30, load_velocity_ratio=10.0, **fields), 0.0
    for event in Integrator(Accuracy(1e-9, 20_000)).follow(
        scene, [maximum("log_slip_rate")], until=40.0
    ):
        porosity, pressure = event.point.psis[1:]
        far = max(far, porosity)
        # Pressure and porosity are integrated separately, with relative errors of 7e-11 per
        # step.
        assert pressure + porosity == pytest.approx(0.0, abs=1e-9)
    assert far > 0.02


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("stress", STRESS)
def test_without_dilatancy_the_fluid_does_nothing(law, stress):
    """Without dilatancy, a fluid does not change the motion.

    The tolerance is the error estimate, because two additional unknowns change the steps.
    """
    fields = {"law": law, "stiffness_ratio": 3.0, "load_velocity_ratio": 3.0, **stress}
    drained, idle = Scene(**fields), dilatant(0.0, 2.0, **fields)
    assert idle.critical_stiffness == pytest.approx(drained.critical_stiffness, rel=1e-9)
    accuracy = Accuracy(1e-8)
    one, other = (StepResponse(peaks=2, phases=5)(scene, accuracy) for scene in (drained, idle))
    peaks = [found.values["max_log10_slip_rate"] for found in (one, other)]
    errors = [found.values["max_log10_slip_rate_error"] for found in (one, other)]
    assert peaks[1] == pytest.approx(peaks[0], abs=sum(errors))


@pytest.mark.parametrize("dilatancy", [0.01, -0.01])
@pytest.mark.parametrize("length", [0.3, 1.0, 7.0])
def test_pressure_at_any_slip_rate_stays_below_its_bound(dilatancy, length):
    """The bound of pore pressure holds for random sequences of slip rates.

    At constant slip rate, porosity and pressure have the closed forms of a rigid slider. With
    compaction, the largest pressure follows an increase of slip rate after slow slip.
    """
    random = np.random.default_rng(585)
    for drainage in (0.02, 0.11, 300.0):
        fluid = dilatant(dilatancy, drainage, porosity_length=length).parts.fluid
        # The first step of the slip rate is the one at which fast drainage approaches the bound.
        rates, states = np.array([-1.0, *random.uniform(-9.0, 1.0, 40)]), [(0.0, 0.0)]
        for x in rates.tolist():
            slip, (porosity, pressure) = 10.0 ** random.uniform(-3.0, 0.5), states[-1]
            r, c, closing = 1.0 / length, drainage * math.exp(-x), porosity - dilatancy * x
            left, drained = math.exp(-r * slip), math.exp(-c * slip)
            closed = r * closing * (left - drained) / (c - r)
            states.append((dilatancy * x + closing * left, pressure * drained + closed))
        for n, now in enumerate(states[:-1]):
            for end in range(n + 1, len(states)):
                highest = max(pressure for _porosity, pressure in states[n : end + 1])
                bound = fluid.compute_pore_pressure_upper_bound(float(rates[n:end].max()), now)
                assert highest <= bound * (1.0 + 1e-12)


# ---- measures ------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", LAWS)
def test_a_hold_drains(law):
    """Pore pressure drains during a hold.

    Compaction during the slow slip of a hold increases the pore pressure, which then drains
    almost without slip.
    """
    scene = dilatant(0.005, 0.1, law=law, load_velocity_ratio=0.0, stiffness_ratio=2.0, **CONSTANT)
    motion = simulate(scene, duration=1e3)
    assert motion.attrs["status"] == "ok"
    pressure, porosity = motion["pore_pressure"].values, motion["porosity"].values
    assert pressure.max() > 1e-3
    assert 0.0 < pressure[-1] < 0.01 * pressure.max()
    # The volume of fluid that has drained equals the lost porosity, which is c times the time
    # integral of P.
    left = 0.1 * PchipInterpolator(motion["time"].values, pressure).integrate(0.0, 1e3)
    assert left == pytest.approx(-porosity[-1] - pressure[-1], rel=1e-3)


# ---- scenes --------------------------------------------------------------------------------------


def tight(log_slip_rate, states, share, p):
    opening = share * (p[FLUID] * log_slip_rate - states[0])
    return opening, -opening


def filled(log_slip_rate, p):
    return p[FLUID] * log_slip_rate, -p[FLUID] * log_slip_rate


@dataclass(frozen=True, kw_only=True)
class Tight(Fluid):
    """User-defined fluid: pores without drainage."""

    opening: float = number(0.005, "", "1", "dilatancy")

    name = "tight"
    unknowns = DilatantFluid.unknowns
    auxiliary_rates = staticmethod(tight)
    auxiliary_steady_states = staticmethod(filled)

    def parameter_values(self, scene):
        return (self.opening,)


@pytest.mark.parametrize("law", LAWS)
def test_a_fluid_of_your_own(law):
    """The undrained critical stiffness is b - a - E at V_*.

    The pressure is a function of porosity, so the second unknown is redundant and small
    changes of it neither grow nor decay.
    """
    scene = Scene(law=law, fluid=Tight, opening=0.004, **CONSTANT)
    assert scene.critical_stiffness == pytest.approx(0.0145 - 0.76 * 0.004, rel=1e-11)
    assert (
        np.abs(stability.compute_linear_growth_rates(scene.with_(stiffness=0.01), 0.0)).min() < 1e-9
    )
    slipped = simulate(scene.with_(stiffness=0.02, load_velocity_ratio=1.5), duration=3.0)
    np.testing.assert_allclose(slipped["porosity"], -slipped["pore_pressure"], atol=1e-12)


@pytest.mark.parametrize("engine", ENGINE_NAMES)
@pytest.mark.parametrize("stress", [{"normal_stress": "constant"}, {"alpha": 0.2}])
def test_a_rig_knows_nothing_of_the_pressure_inside_the_fault(stress, engine):
    """The apparent friction does not include the pressure inside the fault.

    A rig divides by the normal stress minus the external pressure, so it measures dilatant
    hardening.
    """
    scene = Scene(law="slowness", **stress, fluid="dilatant", dilatancy=0.01, drainage=0.1,
                  stiffness_ratio=5.0, load_velocity_ratio=10.0)  # fmt: skip
    motion = simulate(scene, duration=5.0, engine=engine)
    outside = motion.normal_stress_ratio + motion.pore_pressure
    expected = motion.shear_stress / outside
    assert np.allclose(motion.friction_coefficient, expected, rtol=1e-12, atol=0.0)
    # The suction reduces friction by about 2 % of mu_* = 0.76.
    assert float((motion.shear_stress / motion.normal_stress_ratio - expected).min()) < -0.01
