"""Tests of noise that is added to the loading, and of the statistics of events."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rsfstudy.named_studies._bifurcation import Bifurcation
from study_runs import record_computed_cells

import rsfstudy
from rsfstudy import Accuracy, Axis, Integrator, Scene, Study, measures
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import EventStatistics, LimitCycle, Measure
from rsfstudy.motion import rise
from rsfstudy.motion.integration_events import EventKind
from rsfstudy.slider.noise_paths import UnitNoisePath
from rsfstudy.status import Status

BASE = Scene(
    law="slip",
    normal_stress="constant",
    a=0.01,
    b_over_a=1.2,
    stiffness=0.001,
    radiation_damping=1e-4,
)
NOISY = BASE.with_(loading_noise="white", stress_noise=1e-4, noise_interval=0.25, noise_seed=1)


def final_point(scene: Scene, until: float, engine: str = "python", rtol: float = 1e-9):
    """Return the last event of a motion."""
    *_, last = Integrator(Accuracy(rtol, 10**8, engine=engine)).follow(scene, until=until)
    return last


# ---- paths ---------------------------------------------------------------------------------------

TIMES = st.floats(min_value=1e-3, max_value=10.0)


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 100_000),
    interval=TIMES,
    first=st.integers(0, 10**7),
    count=st.integers(1, 40),
    correlation_time=st.one_of(st.none(), st.floats(0.01, 100.0)),
    power=st.integers(1, 5),
)
def test_a_path_depends_on_seed_and_time_only(
    seed, interval, first, count, correlation_time, power
):
    path = UnitNoisePath(seed, 0, correlation_time)
    values = path.compute_samples(interval, first, count)
    assert np.isfinite(values).all()
    # Any section equals the same section of a longer path, and of a finer path.
    longer = path.compute_samples(interval, max(first - 3, 0), count + 7)
    np.testing.assert_array_equal(longer[min(first, 3) :][:count], values)
    finer = path.compute_samples(interval / 2**power, first * 2**power, (count - 1) * 2**power + 1)
    np.testing.assert_array_equal(finer[:: 2**power], values)


def test_the_path_is_a_wiener_process():
    interval = 0.05
    steps = np.diff(
        [UnitNoisePath(seed, 0).compute_samples(interval, 0, 2001) for seed in range(100)]
    ) / math.sqrt(interval)
    count = steps.size
    assert abs(steps.mean()) < 4.0 / math.sqrt(count)
    assert abs(steps.var() - 1.0) < 4.0 * math.sqrt(2.0 / count)
    assert abs((steps**4).mean() - 3.0) < 4.0 * math.sqrt(96.0 / count)
    for lag in (1, 2, 5):
        assert abs((steps[:, lag:] * steps[:, :-lag]).mean()) < 4.0 / math.sqrt(count)
    ends = np.array(
        [UnitNoisePath(seed, 0).compute_samples(interval, 1000, 1)[0] for seed in range(1000)]
    )
    assert abs(ends.var() / 50.0 - 1.0) < 4.0 * math.sqrt(2.0 / 1000)


def test_streams_and_seeds_are_independent():
    paths = [
        np.diff(UnitNoisePath(seed, stream).compute_samples(0.1, 0, 4001))
        for seed in (1, 2)
        for stream in (0, 1)
    ]
    correlations = np.corrcoef(paths)[~np.eye(4, dtype=bool)]
    assert np.abs(correlations).max() < 4.5 / math.sqrt(4000)


@pytest.mark.parametrize("interval", [0.1, 1.7])
def test_variance_and_correlation_of_correlated_noise(interval):
    """The variance approaches t_c/2, and the correlation decays with the time t_c."""
    time, lag, count = 2.0, 10, 1000
    last = 400
    values = np.array(
        [
            UnitNoisePath(seed, 0, time).compute_samples(interval, last - lag, lag + 1)[[0, -1]]
            for seed in range(count)
        ]
    )
    variance = 0.5 * time
    assert abs(values.var(axis=0) / variance - 1.0).max() < 4.0 * math.sqrt(2.0 / count)
    expected = math.exp(-lag * interval / time)
    assert abs(np.mean(values[:, 0] * values[:, 1]) / variance - expected) < 4.0 * math.sqrt(
        2.0 / count
    )
    # For short times, the path differs little from the Wiener process.
    early = np.array(
        [UnitNoisePath(seed, 0, 1e6).compute_samples(interval, 4, 1)[0] for seed in range(count)]
    )
    assert abs(early.var() / (4.0 * interval) - 1.0) < 4.0 * math.sqrt(2.0 / count)


def test_known_values_of_a_path():
    """The values are part of the contract, because files store only the seed."""
    np.testing.assert_allclose(
        UnitNoisePath(3, 0).compute_samples(0.05, 0, 4),
        [0.0, -0.2589843615, -0.0369369501, -0.0800173363],
        rtol=0.0,
        atol=1e-8,
    )


# ---- motions -------------------------------------------------------------------------------------


def test_engines_agree_on_a_path():
    pytest.importorskip("numba")
    compiled = final_point(NOISY, 60.0, "compiled")
    scipy = final_point(NOISY, 60.0, "scipy")
    assert compiled.point.log_slip_rate == pytest.approx(scipy.point.log_slip_rate, abs=1e-10)
    assert compiled.slip == pytest.approx(scipy.slip, abs=1e-10)


def test_noise_of_zero_amplitude_changes_nothing():
    still = NOISY.with_(stress_noise=0.0, displacement_step=0.1, load_velocity_ratio=1.0)
    smooth = still.with_(loading_noise="none")
    ends = [final_point(scene, 20.0) for scene in (still, smooth)]
    assert ends[0].point.log_slip_rate == pytest.approx(ends[1].point.log_slip_rate, abs=1e-7)
    assert ends[0].slip == pytest.approx(ends[1].slip, abs=1e-8)


def test_the_noise_moves_the_load_point():
    """The stress of the noise equals a displacement of the load point."""
    motion = rsfstudy.simulate(NOISY, duration=5.0, engine="python")
    values = NOISY.stress_noise * UnitNoisePath(1, 0).compute_samples(0.25, 0, 21)
    expected = 1.0 * motion.time + np.interp(motion.time, 0.25 * np.arange(21), values) / 0.001
    np.testing.assert_allclose(motion.load_point_displacement, expected, atol=1e-6)


def test_strong_convergence_of_first_order():
    """The error on fixed paths is proportional to the sampling interval."""
    pytest.importorskip("numba")
    ends = []
    for seed in range(60):
        scene = NOISY.with_(noise_seed=seed, displacement_step=3.0, load_velocity_ratio=1.0)
        finer = (scene.with_(noise_interval=h) for h in (0.4, 0.2, 0.1, 0.4 / 64))
        motions = (final_point(one, 8.0, "compiled", rtol=1e-8) for one in finer)
        ends.append([last.point.log_slip_rate for last in motions])
    ends = np.array(ends)
    errors = np.sqrt(np.mean((ends[:, :-1] - ends[:, -1:]) ** 2, axis=0))
    orders = np.log2(errors[:-1] / errors[1:])
    assert 0.8 < orders.mean() < 1.2, orders
    assert errors[-1] < 2e-3


def test_a_motion_with_noise_can_be_continued():
    whole = rsfstudy.simulate(NOISY, duration=7.3, engine="python", rtol=1e-9)
    begun = rsfstudy.simulate(NOISY, duration=3.1, engine="python", rtol=1e-9)
    rest = rsfstudy.simulate(NOISY, duration=4.2, start=begun, engine="python", rtol=1e-9)
    for name in ("log10_slip_rate", "slip", "shear_stress"):
        assert float(rest[name][-1]) == pytest.approx(float(whole[name][-1]), abs=1e-8)


def test_noise_with_a_protocol():
    """The path continues through the segments, and each segment reports its start."""
    protocol = rsfstudy.protocol(
        [{"velocity": 1, "duration": 1.3}, {"velocity": 3, "duration": 1.1}, {"velocity": 1}],
        name="noisy_steps",
    )
    scene = NOISY.with_(loading=protocol)
    events = list(Integrator(Accuracy(1e-9, engine="python")).follow(scene, until=4.0))
    assert [e.time for e in events if e.kind is EventKind.SEGMENT_START] == pytest.approx(
        [1.3, 2.4]
    )
    motion = rsfstudy.simulate(scene, duration=4.0, engine="python")
    noise = scene.stress_noise * np.interp(
        4.0, 0.25 * np.arange(17), UnitNoisePath(1, 0).compute_samples(0.25, 0, 17)
    )
    expected = 1.3 + 3.3 + 1.6 + noise / scene.stiffness
    assert float(motion.load_point_displacement[-1]) == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("kind", ["white", "correlated"])
def test_noise_of_normal_stress(kind):
    scene = BASE.with_(
        normal_stress="imposed",
        alpha=0.3,
        loading_noise=kind,
        normal_stress_noise=1e-3,
        noise_interval=0.25,
        noise_seed=5,
    )
    motion = rsfstudy.simulate(scene, duration=5.1, engine="python")
    time = 2.0 if kind == "correlated" else None
    scene = scene if time is None else scene.with_(noise_correlation_time=time)
    motion = rsfstudy.simulate(scene, duration=5.1, engine="python")
    values = 1.0 + 1e-3 * UnitNoisePath(5, 1, time).compute_samples(0.25, 0, 22)
    expected = np.interp(motion.time, 0.25 * np.arange(22), values)
    np.testing.assert_allclose(motion.normal_stress_ratio, expected, atol=1e-9)
    # The load point moves steadily.
    np.testing.assert_allclose(motion.load_point_displacement, motion.time, atol=1e-6)


def test_lost_normal_stress_ends_the_motion():
    scene = BASE.with_(
        normal_stress="imposed", loading_noise="white", normal_stress_noise=1.0, noise_interval=0.25
    )
    with pytest.warns(rsfstudy.errors.IncompleteWarning):
        motion = rsfstudy.simulate(scene, duration=500.0, engine="python")
    assert motion.status in ("normal_stress_lost", "shear_stress_reversed")


def test_noise_with_mass_agrees_with_radiation_damping_of_slow_slip():
    """At slow slip, neither mass nor its regimes matter."""
    slow = BASE.with_(
        radiation_damping=0.0, loading_noise="white", stress_noise=1e-4, noise_interval=0.25
    )
    massive = slow.with_(inertia=True, period=1.0)
    ends = [final_point(scene, 6.0) for scene in (slow, massive)]
    assert ends[0].point.log_slip_rate == pytest.approx(ends[1].point.log_slip_rate, abs=1e-6)


def test_noise_in_ruptures_with_mass():
    """The energy balance of the spring includes the noise in all regimes."""
    scene = BASE.with_(
        radiation_damping=0.0,
        inertia=True,
        period=200.0,
        reference_rate=1e-3,
        loading_noise="white",
        stress_noise=1e-4,
        noise_interval=0.25,
        displacement_step=3.0,
        load_velocity_ratio=1.0,
    )
    motion = rsfstudy.simulate(scene, duration=30.0, engine="python")
    assert scene.RUPTURE_REGIME in motion.regime.flag_meanings.split()
    assert (motion.regime == motion.regime.flag_meanings.split().index("inertial")).any()
    values = 1e-4 * UnitNoisePath(0, 0).compute_samples(0.25, 0, 122)
    expected = 3.0 + motion.time + np.interp(motion.time, 0.25 * np.arange(122), values) / 0.001
    np.testing.assert_allclose(motion.load_point_displacement, expected, atol=1e-5)


# ---- statistics ----------------------------------------------------------------------------------


def test_statistics_agree_with_direct_moments():
    measure = EventStatistics(cycles=12, discarded_cycles=3, checked_cycles=4)
    scene = NOISY.with_(noise_interval=1.0)
    values = measure(scene, Accuracy(1e-7, 10**7, engine="python")).values
    level = math.log(measure.slip_rate_ratio)
    times, armed = [], True
    asked = rise("log_slip_rate", level), rise("log_slip_rate", 0.0)
    motion = Integrator(Accuracy(1e-7, 10**7, engine="python")).follow(scene, asked, until=500.0)
    for event in motion:
        if event.specification == asked[0] and armed:
            times.append(event.time)
            armed = False
        armed = armed or event.specification == asked[1]
    intervals = np.diff(times)[3:15]
    assert values["recurrence_interval_mean"] == pytest.approx(intervals.mean(), rel=1e-6)
    deviation = intervals.std(ddof=1)
    assert values["recurrence_interval_sd"] == pytest.approx(deviation, rel=1e-5)
    assert values["recurrence_interval_mean_stderr"] == pytest.approx(deviation / math.sqrt(12))
    assert values["recurrence_interval_cv"] == pytest.approx(deviation / intervals.mean())
    assert 0.0 < values["recurrence_interval_mean_path_error"] < 0.1
    assert 0.0 < values["recurrence_interval_mean_error"] < 1e-4


def test_statistics_without_noise_are_those_of_the_limit_cycle():
    measure = EventStatistics(cycles=6, discarded_cycles=10, checked_cycles=4)
    accuracy = Accuracy(1e-8, 10**7, engine="python")
    values = measure(BASE, accuracy).values
    cycle = LimitCycle(phases=2)(BASE, accuracy).values
    for name in ("recurrence_interval", "static_stress_drop"):
        assert values[f"{name}_mean"] == pytest.approx(cycle[name], rel=1e-7)
        assert values[f"{name}_cv"] < 1e-7
        assert values[f"{name}_mean_path_error"] == 0.0


def test_weak_noise_leaves_the_stress_drop():
    """The events of weak noise have the same definition as the limit cycle."""
    scene = NOISY.with_(stress_noise=1e-8, noise_interval=1.0)
    measure = EventStatistics(cycles=4, discarded_cycles=8, checked_cycles=4)
    accuracy = Accuracy(1e-8, 10**7, engine="python")
    values = measure(scene, accuracy).values
    cycle = LimitCycle(phases=2)(BASE, accuracy).values
    for name in ("recurrence_interval", "static_stress_drop"):
        assert values[f"{name}_mean"] == pytest.approx(cycle[name], rel=1e-5)


def test_cv_follows_from_the_phase_response():
    """The sensitivity of the CV to weak noise is 220.448392 (see the study noisy_recurrence)."""
    pytest.importorskip("numba")
    measure = EventStatistics(cycles=1500, checked_cycles=4)
    scene = NOISY.with_(noise_interval=0.5)
    values = measure(scene, Accuracy(1e-6, 10**8, engine="compiled")).values
    theory = 1e-4 * 220.448392
    error = values["recurrence_interval_cv_stderr"]
    assert error == pytest.approx(theory / math.sqrt(2 * 1500), rel=0.15)
    assert abs(values["recurrence_interval_cv"] - theory) < 0.015 * theory + 3.0 * error


def test_events_of_simulated_motions_use_two_levels():
    """Crossings of one level by the noise are one event."""
    pytest.importorskip("numba")
    scene = NOISY.with_(stress_noise=1e-3, noise_interval=0.02, noise_seed=2)
    motion = rsfstudy.simulate(scene, duration=300.0, engine="compiled")
    measured = motion.rsf.events()
    fast = motion.log10_slip_rate.values > 1.0
    slow = motion.log10_slip_rate.values <= 0.0
    events, armed = 0, True
    for is_fast, is_slow in zip(fast, slow, strict=True):
        events += bool(is_fast and armed)
        armed = (armed and not is_fast) or bool(is_slow)
    assert measured.sizes["event"] == events


def test_a_settling_motion_has_no_statistics():
    stable = BASE.with_(stiffness=0.01, displacement_step=0.1, load_velocity_ratio=1.0)
    outcome = EventStatistics(cycles=4)(stable, Accuracy(1e-6, engine="python"))
    assert outcome.status is Status.NO_LIMIT_CYCLE
    held = BASE.with_(load_velocity_ratio=0.0)
    assert EventStatistics(cycles=4)(held, Accuracy(1e-6)).status is Status.NO_LIMIT_CYCLE


@pytest.mark.parametrize(
    "wrong",
    [{"cycles": 3}, {"discarded_cycles": -1}, {"checked_cycles": 2.5}, {"slip_rate_ratio": 1.0}],
)
def test_wrong_fields_of_the_measure(wrong):
    with pytest.raises(InvalidValue):
        EventStatistics(**wrong)


#: Fields that the scene of a measure needs.
FIELDS_BY_MEASURE = {"healing": {"hold_time": 10.0, "stiffness": 0.02}}
#: Measures that serve scenes with noise, or do not follow a motion. Fits refuse all such loadings.
SERVE_NOISE = {"event_statistics", "peak_statistics", "linear_stability", "fit", "synthetic_fit"}


def measures_of_motions() -> list[Measure]:
    """Return the measures that follow a motion until it settles or repeats."""
    public = [getattr(measures, name) for name in measures.__all__]
    made = [
        kind() for kind in public if isinstance(kind, type) and issubclass(kind, Measure)
        if kind not in (Measure, measures.Elasticities, measures.Fit)
    ]  # fmt: skip
    made += [measures.Elasticities(LimitCycle(), parameters=("a",)), Bifurcation()]
    return [measure for measure in made if measure.name not in SERVE_NOISE]


@pytest.mark.parametrize("measure", measures_of_motions(), ids=lambda measure: measure.name)
def test_measures_of_smooth_loading_refuse_noise(measure):
    scene = NOISY.with_(load_velocity_ratio=2.0, **FIELDS_BY_MEASURE.get(measure.name, {}))
    with pytest.raises(InvalidValue, match=r"loading_noise = 'white' changes stress at random"):
        measure(scene, Accuracy())


def test_stability_ignores_noise():
    assert NOISY.critical_stiffness == BASE.critical_stiffness
    np.testing.assert_array_equal(NOISY.linear_growth_rates(0.0), BASE.linear_growth_rates(0.0))


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"oscillation_amplitude": 0.1}, "cannot be added to the loading 'oscillation'"),
        ({"noise_seed": 0.5}, "whole number"),
        ({"stress_noise": -1.0}, "must be 0 or greater"),
        ({"normal_stress_noise": 1e-3}, "cannot be combined with a loading or noise"),
        ({"loading_noise": "none", "stress_noise": 1e-4}, "does not apply without noise"),
    ],
)
def test_wrong_noise(fields, text):
    known = {"normal_stress": "constant", "loading_noise": "white", "stress_noise": 1e-4}
    with pytest.raises(InvalidValue, match=text):
        Scene(**{**known, **fields})


def test_results_do_not_depend_on_the_workers(tmp_path):
    """The seed defines the path in all processes, and finished cells are reused."""
    study = Study(
        name="noise_of_workers",
        title="noise",
        base=NOISY.with_(noise_interval=2.0),
        axes=[Axis("sample", {"noise_seed": [0, 1, 2]})],
        measure=EventStatistics(cycles=4, discarded_cycles=1, checked_cycles=4),
        accuracy=Accuracy(rtol=1e-4),
    )
    options = {"output": None, "progress": False}
    alone = rsfstudy.run(study, workers=0, **options)
    shared = rsfstudy.run(study, workers=2, **options)
    np.testing.assert_array_equal(alone.recurrence_interval_mean, shared.recurrence_interval_mean)
    assert len(set(alone.recurrence_interval_mean.values.tolist())) == 3
    # A run of some seeds is extended by the other seeds, as a resumed run is.
    first = replace(study, axes=[Axis("sample", {"noise_seed": [2]})])
    rsfstudy.run(first, workers=0, output=tmp_path, progress=False)
    with record_computed_cells() as computed:
        rsfstudy.run(study, workers=0, output=tmp_path, progress=False)
    assert len(computed) == 2
    reopened = rsfstudy.open(tmp_path / "noise_of_workers.nc")
    assert reopened.noise_interval.item() == 2.0
    assert not any("path" in name and "error" not in name for name in reopened.variables)
    np.testing.assert_array_equal(reopened.recurrence_interval_mean, alone.recurrence_interval_mean)
