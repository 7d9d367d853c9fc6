"""Tests of user-defined parts, measures, reductions, figures and steppers.

Each example is a single file outside of the package. The examples must run, can be checked,
repeated and plotted, and reproduce closed forms.
"""

import copy
import json
import math
import pickle
import shutil
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace

import cloudpickle
import numpy as np
import pytest
from frozen_motion_comparison import largest_differences, record_frozen_motion
from frozen_scenes import Motion
from study_runs import call_main, have_same_numbers, run, study_of

import rsfstudy
from rsfstudy import Axis, Scene, Study, limit_cycle, plots
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure, Outcome
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.slider import laws, parameter_layout, part_registry
from rsfstudy.slider.dynamics.quasi_static import QuasiStatic
from rsfstudy.slider.laws.slip import SlipLaw
from rsfstudy.slider.loading.step import StepLoading
from rsfstudy.slider.normal_stress import NormalStress
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.slider.parts import flag, number
from rsfstudy.status import Status
from rsfstudy.study import study_loader
from rsfstudy.study.figure_declarations import Figure, Panel

#: Fields of every scene. Other fields are part of a scene only if they have a value.
PLAIN = tuple(
    name
    for name in part_registry.SCENE_FIELD_NAMES
    if name not in part_registry.DEFAULTS_OMITTED_FROM_STORED_SCENES
)
EXAMPLES = sorted((Path(__file__).parent / "extensions").glob("*.py"))
#: One cell of each study.
PLACES = {
    "steep_law": {"law": "steep", "stiffness_ratio": 2.0},
    "saturating_law": {"sharpness": 0.5, "stiffness_ratio": 1.5},
    "hold_and_reload": {"rest_time": 1e4},
    "stress_weakening": {"normal_stress": "variable", "c": 2.0},
    "loading_time": {"load_velocity_ratio": 10.0},
    "power_law": {"b_over_a": 2.0, "a": 0.01},
    "own_figure": {"phi": 60.0, "b_over_a": 2.0},
    "order_four": {"b_over_a": 2.0},
}


@pytest.fixture(scope="module")
def outside(tmp_path_factory, cluster):
    """Run each example in a separate directory on two workers."""
    ran = {}
    for example in EXAMPLES:
        place = tmp_path_factory.mktemp(example.stem)
        study = place / "mine.py"
        shutil.copy(example, study)
        dataset = rsfstudy.run(study, client=cluster, output=place, progress=False)
        file = place / f"{dataset.attrs['id']}.nc"
        ran[example.stem] = SimpleNamespace(study=study, file=file, dataset=dataset)
    return ran


def test_every_example_is_used():
    assert {example.stem for example in EXAMPLES} == set(PLACES)


# ---- like ours ----------------------------------------------------------------------------------
@pytest.mark.parametrize("name", PLACES)
def test_it_is_checked_rerun_and_drawn(name, outside):
    example = outside[name]
    assert (example.dataset.status == int(Status.OK)).all(), example.dataset.message.values
    have_same_numbers(rsfstudy.open(example.file), example.dataset)
    checked = call_main("check", example.file)
    assert checked.returncode == 0, checked.stderr
    drawn = call_main("plot", example.file, "--study", example.study)
    assert (drawn.returncode, drawn.stderr) == (0, "")
    assert example.file.with_suffix(".png").is_file()


@pytest.mark.parametrize("name", PLACES)
def test_one_cell_and_all_cells_are_as_on_the_workers(name, outside):
    example, place = outside[name], PLACES[name]
    _scene, found = rsfstudy.recompute_cell(example.file, place, study=example.study)
    there = example.dataset.sel(place)
    for number_, value in found.values.items():
        assert float(value) == pytest.approx(float(there[number_]), rel=0.0, abs=0.0, nan_ok=True)
    agreed = rsfstudy.rerun(example.file, study=example.study, workers=0, progress=False)
    assert (agreed["values"] == agreed["identical"]).all()
    assert agreed.attrs["differs"] == {}


@pytest.mark.parametrize(
    "name", ["steep_law", "saturating_law", "hold_and_reload", "stress_weakening"]
)
def test_its_motions_are_the_same_compiled(name, outside):
    """Motions with user-defined parts are the same for both engines.

    Both engines take the same steps, so the motions differ by rounding errors only.
    """
    *_others, scene = study_loader.load_study(str(outside[name].study)).scenes()
    stepped = {"rest_time": 30.0} if name == "hold_and_reload" else {"load_velocity_ratio": 2.0}
    scene = scene.with_(**stepped)
    motion = Motion({"a": scene.a}, until=300.0, rtol=1e-8)
    one, other = (record_frozen_motion(motion, engine, scene) for engine in ("scipy", "compiled"))
    assert len(one.kinds) > 3
    along, of_steps = largest_differences(motion, one, other)
    assert along < 1e-12
    assert of_steps < 1e-8


def test_what_it_says_of_itself_is_in_the_file_and_on_the_figure(outside):
    example = outside["saturating_law"]
    about = rsfstudy.open(example.file).sharpness.attrs
    stated = {"long_name": "sharpness of the law", "units": "1", "symbol": "$n$"}
    assert stated.items() <= about.items()
    lattice = example.dataset.transpose("stiffness_ratio", "sharpness", ...)
    assert plots.draw_figure(lattice).axes[0].get_xlabel() == "Sharpness of the law, $n$"
    assert outside["loading_time"].dataset.loading_time.attrs["units"] == "s"
    exponent = outside["power_law"].dataset.exponent
    assert exponent.attrs["long_name"] == "exponent of critical_stiffness as a power of a"
    assert exponent.attrs["symbol"] == "$n$"


def test_what_has_no_meaning_in_a_cell_is_left_out(outside):
    """Cells that differ in an inapplicable field only are the same cell."""
    study = study_loader.load_study(str(outside["saturating_law"].study))
    dataset = run(study, law=["slip", "saturating"], stiffness_ratio=[0.8])
    assert dataset.sizes == {"law": 2, "sharpness": 3, "stiffness_ratio": 1}
    slip, own = dataset.critical_displacement.squeeze("stiffness_ratio").transpose("law", ...)
    assert len(set(slip.values)) == 1
    assert float(own[0]) == pytest.approx(float(slip[0]), rel=1e-9)


# ---- the numbers are those of mathematics -------------------------------------------------------
def test_a_stepper_of_a_users_own(outside):
    """A user-defined stepper agrees with V_0/V_* = 1 + a/(b - a).

    The closed form holds at the critical stiffness, constant normal stress and infinite
    norm. The norm of 5e-4 lowers the value by a fraction of 5e-3 at b/a = 1.5, and of 2e-5
    at b/a = 2. The requested accuracy is 1e-4.
    """
    found = outside["order_four"]
    bias = {1.5: 0.02, 2.0: 1e-4}
    for step in found.dataset.critical_velocity_ratio:
        b_over_a = float(step.b_over_a)
        assert float(step) == pytest.approx(1.0 + 1.0 / (b_over_a - 1.0), abs=bias[b_over_a])
    stepper = study_loader.load_study(str(found.study))
    assert stepper.accuracy.engine == "order_four"
    scene = stepper.base.with_(inertia=True, stiffness_ratio=0.8, load_velocity_ratio=2.0)
    ours, theirs = (limit_cycle(scene, rtol=1e-5, engine=by) for by in ("order_four", "scipy"))
    assert ours.attrs["engine"] == "order_four"
    for name in ("recurrence_interval", "static_stress_drop", "max_log10_slip_rate"):
        allowed = float(ours[f"{name}_error"] + theirs[f"{name}_error"])
        assert float(ours[name]) == pytest.approx(float(theirs[name]), abs=allowed), name


def test_a_hold_and_a_reload(outside):
    """Relaxation and peak stress agree with closed forms.

    For the slowness law with r = k/k_cr, the stress relaxes by a r ln(r)/(r - 1) sigma_*.
    After a long hold t, it peaks at b ln(t) - a b ln(K/b)/(K - b). The neglected terms are
    proportional to 1/t.
    """
    found = outside["hold_and_reload"]
    study = study_loader.load_study(str(found.study))
    scene, hold = study.base, found.dataset.rest_time
    a, b, stiffness, ratio = scene.a, scene.b, scene.stiffness, scene.stiffness_ratio
    limit = -a * ratio * math.log(ratio) / (ratio - 1.0)
    assert found.dataset.relaxation.values[0] == pytest.approx(limit, rel=1e-4)
    assert found.dataset.relaxation.values[1] == pytest.approx(limit, rel=1e-6)
    peak = b * np.log(hold) - a * b * math.log(stiffness / b) / (stiffness - b)
    assert found.dataset.peak_stress.values[0] == pytest.approx(peak.values[0], rel=1e-4)
    assert found.dataset.peak_stress.values[1] == pytest.approx(peak.values[1], rel=1e-6)


def test_the_symmetric_law(outside):
    """Critical steps of the symmetric law agree with the closed form.

    If the load point is held, the critical step is asinh(2 r)/(2 r) a/(b - a) D_c with r =
    k/k_cr, and a/(b - a) D_c for the slip law.
    """
    found = outside["steep_law"].dataset.critical_displacement
    ratio = found.stiffness_ratio
    exact = np.arcsinh(2.0 * ratio) / (2.0 * ratio)
    np.testing.assert_allclose(found.sel(law="steep"), exact, rtol=1e-6)
    np.testing.assert_allclose(found.sel(law="slip"), 1.0, rtol=1e-6)


def test_the_saturating_laws(outside):
    """Critical steps of the saturating law agree with the closed form.

    The critical step is artanh(n r)/(n r) a/(b - a) D_c with r = k/k_cr. If n r is 1 or
    larger, no step triggers instability.
    """
    found = outside["saturating_law"].dataset.critical_displacement
    for sharpness, ratio in ((0.0, 0.8), (0.0, 1.5), (0.5, 0.8), (0.5, 1.5), (1.0, 0.8)):
        product = sharpness * ratio
        exact = math.atanh(product) / product if product else 1.0
        tolerance = 1e-6 if product < 0.75 else 1e-4  # The norm is finite.
        ours = float(found.sel(sharpness=sharpness, stiffness_ratio=ratio))
        assert ours == pytest.approx(exact, rel=tolerance)


def test_stress_that_wears_the_state_away(outside):
    """The critical stiffness is divided by 1 + c at constant normal stress.

    With all effects, the critical stiffness agrees with the growth rates of the assembled
    equations.
    """
    dataset = outside["stress_weakening"].dataset
    constant = dataset.critical_stiffness.sel(normal_stress="constant")
    expected = float(constant.sel(c=0.0)) / (1.0 + dataset.c)
    np.testing.assert_allclose(constant, expected, rtol=1e-12)
    grown = dataset.critical_stiffness_from_growth
    np.testing.assert_allclose(dataset.critical_stiffness, grown, rtol=1e-6)


def test_a_measure_a_reduction_and_a_figure(outside):
    times = outside["loading_time"].dataset.loading_time
    base = Scene(normal_stress="constant")
    seconds = base.a / (base.stiffness * base.reference_rate)
    np.testing.assert_allclose(times * times.load_velocity_ratio, seconds, rtol=1e-14)
    np.testing.assert_allclose(outside["power_law"].dataset.exponent, 1.0, rtol=1e-12)
    study = study_loader.load_study(str(outside["own_figure"].study))
    drawn = plots.draw_figure(outside["own_figure"].dataset, study.plot).axes[0]
    assert drawn.get_ylabel() == "Angle (degrees)"


# ---- without its file, and with another ---------------------------------------------------------
def test_without_the_study_file(outside, tmp_path, monkeypatch):
    """Without the study file, errors explain which operations need it.

    Operations that need no code still work.
    """
    gone = tmp_path / "mine.py"
    for name in ("own_figure", "saturating_law"):
        shutil.copy(outside[name].file, tmp_path)
    saturating, figure = (outside[n].file.name for n in ("saturating_law", "own_figure"))
    monkeypatch.chdir(tmp_path)
    drawn = call_main("plot", figure)
    assert drawn.returncode == 0
    assert "plot = 'stiffness_map' is not a figure of" in " ".join(drawn.stderr.split())
    assert "--study" in drawn.stderr
    as_lines = Path(figure).with_suffix(".png").read_bytes()
    assert call_main("plot", figure, "--study", outside["own_figure"].study).stderr == ""
    assert Path(figure).with_suffix(".png").read_bytes() != as_lines
    assert call_main("plot", figure, "--study", gone).stderr.startswith("error: study '")
    with pytest.raises(InvalidValue, match="'saturating' is user-defined.*--study FILE.*mine.py"):
        rsfstudy.recompute_cell(saturating, PLACES["saturating_law"])
    with pytest.raises(InvalidValue, match="declares the study 'stiffness_map'"):
        rsfstudy.recompute_cell(
            saturating, PLACES["saturating_law"], study=outside["own_figure"].study
        )
    with pytest.raises(InvalidValue, match="reduction 'exponent'.*--study FILE"):
        rsfstudy.rerun(outside["power_law"].file, workers=0)


def test_a_process_that_does_not_know_the_parts_opens_their_results(outside, monkeypatch):
    for slot in part_registry.PART_SLOTS:
        monkeypatch.setitem(vars(slot), "user_parts", {})
    dataset = rsfstudy.open(outside["saturating_law"].file)
    assert dataset.attrs["id"] == "saturating_laws"
    assert rsfstudy.check(dataset).empty
    with pytest.raises(InvalidValue, match="law = 'saturating' is unknown"):
        Scene(law="saturating")


# ---- in a notebook, or anywhere -----------------------------------------------------------------
@dataclass(frozen=True, kw_only=True)
class Doubled(SlipLaw):
    factor: float = number(2.0, "$f$", "1", "factor of nothing", rule="must be 0 or greater")
    is_odd: bool = flag(False, "whether it is odd")

    name = "doubled"


@dataclass(frozen=True, kw_only=True)
class Sticky(QuasiStatic):
    grip: float = number(1.0, "$g$", "m", "grip of nothing", scale="D_c")

    name = "sticky"


@dataclass(frozen=True, kw_only=True)
class Steplike(StepLoading):
    name = "steplike"


@dataclass(frozen=True, kw_only=True)
class Unvaried(NormalStress):
    name = "unvaried"


def test_a_scene_of_ones_own_parts():
    scene = Scene(law=Doubled, factor=3, normal_stress=Unvaried, dynamics=Sticky, loading=Steplike)
    values = scene.as_dict()
    assert tuple(values)[: len(PLAIN)] == PLAIN
    own = {"factor": 3.0, "is_odd": False, "dynamics": "sticky", "grip": 1.0, "loading": "steplike"}
    assert {name: values[name] for name in tuple(values)[len(PLAIN) :]} == own
    assert (scene.law, scene.normal_stress, scene.alpha) == ("doubled", "unvaried", None)
    assert Scene(**values) == scene  # The names are known now.
    for again in (pickle.loads(pickle.dumps(scene)), copy.deepcopy(scene),
                  cloudpickle.loads(cloudpickle.dumps(scene))):  # fmt: skip
        assert again == scene
        assert again.parts == scene.parts
    assert scene.with_(grip=2.0).grip == 2.0
    plain = scene.with_(law="slip", normal_stress="variable", dynamics=None, loading=None)
    assert plain == Scene()
    assert tuple(plain.as_dict()) == PLAIN
    assert Scene(law=SlipLaw) == Scene()


@pytest.mark.parametrize(
    ("given", "rule"),
    [
        ({"law": "slip", "factor": 2.0}, "factor = 2.0 does not apply to law='slip'.*'doubled'"),
        ({"law": Doubled, "factor": -1.0}, "'factor' must be 0 or greater"),
        ({"law": "doubeld"}, "law = 'doubeld' is unknown. Did you mean 'doubled'"),
        ({"dynamics": Sticky, "inertia": True}, "inertia = True does not apply to 'sticky'"),
        (
            {"law": Sticky},
            "law = .*is not a class that defines the law of a scene. Derive a class from",
        ),
        ({"law": int}, "law = <class 'int'> is not a class that defines the"),
    ],
)
def test_scenes_that_are_refused(given, rule):
    Scene(law=Doubled)
    with pytest.raises(InvalidValue, match=rule):
        Scene(**given)


def linear(x, state, p):
    return -(state + p[LAW] * x)


def made(base=laws.Law, frozen=True, **body):
    """Return a class of a law, or an invalid class."""
    annotations = {name: float for name, value in body.items() if hasattr(value, "metadata")}
    stated = {"name": "made", "evolution": staticmethod(linear), **body}
    kind = type("Made", (base,), {**stated, "__annotations__": annotations})
    return dataclass(frozen=frozen, kw_only=True)(kind) if frozen else kind


ANOTHER = number(1.0, "", "1", "another")
#: Bodies of invalid classes, by error message.
NO_LAW = {
    "must be a frozen dataclass": [{"frozen": False}],
    "must have a Python identifier": [{"name": None}, {"name": "my law"}],
    "has the name": [{"name": "slowness"}, {"name": "inertia"}, {"name": "doubled"}],
    "does not define evolution": [{"evolution": None}, {"evolution": lambda x, state, p: -x}],
    "has neither a description": [{"c": field(default=1.0)}],
    "is already the name": [
        {name: ANOTHER} for name in ("phi", "a", "b_over_a", "stiffness", "b", "parts", "loading")
    ],
}


@pytest.mark.parametrize("rule", NO_LAW)
def test_classes_that_fill_no_slot(rule):
    Scene(law=Doubled)
    for body in NO_LAW[rule]:
        with pytest.raises(InvalidValue, match=f"(?s){rule}"):
            Scene(law=made(**body))


@pytest.mark.parametrize(
    ("body", "complaint"),
    [
        ({}, r"changes by .* per D_c in steady sliding.*Define steady_states\("),
        ({"steady_states": lambda x, shift, p: (shift - 0.9 * p[LAW] * x,)}, ""),
        (
            {
                "evolution": lambda x, state, p: -(state - 0.1 * p[LAW] + p[LAW] * x),
                "steady_states": lambda x, shift, p: (shift + p[LAW] * (0.1 - x),),
            },
            "has states with the sum 0.*at V_[*]",
        ),
        (
            {
                "evolution": lambda x, state, p: state + 0.9 * p[LAW] * x,
                "steady_states": lambda x, shift, p: (shift - 0.9 * p[LAW] * x,),
            },
            "moves away from steady sliding at .* growth rate of 1 per D_c",
        ),
    ],
)
def test_a_law_rests_in_its_steady_states(body, complaint):
    """The steady states of a user-defined law are verified.

    The law weakens by 0.9 b, so its steady states differ from the default.
    """
    functions = {"evolution": lambda x, state, p: -(state + 0.9 * p[LAW] * x), **body}
    functions = {name: staticmethod(function) for name, function in functions.items()}
    with pytest.raises(InvalidValue, match=complaint) if complaint else nullcontext():
        Scene(law=made(name="weaker", **functions), b_over_a=2.0)


def test_members_may_bear_their_former_names():
    with pytest.warns(DeprecationWarning, match="'resting' of Made is now called"):
        part = made(name="formerly", resting=staticmethod(lambda log_slip_rate, shift, p: (shift,)))
    assert part.steady_states is part.resting


def test_a_part_has_as_many_numbers_as_there_are_places():
    def numbers(self, scene):
        return tuple(range(parameter_layout.FLUID - parameter_layout.NORMAL_STRESS + 1))

    scene = Scene(
        normal_stress=made(Unvaried, name="numerous", parameter_values=numbers), stiffness=0.01
    )
    with pytest.raises(
        InvalidValue, match="'numerous' has 3 parameters, but at most 2 are allowed"
    ):
        _asked = scene.parameter_values


def test_a_field_may_be_stated_anew_with_another_default():
    words = "$b/a$", "1", "ratio of evolution effect to direct effect"
    ours = number(3.0, *words, rule="must be greater than 0")
    assert Scene(law=made(name="steeper", b_over_a=ours)).b_over_a == 3.0


def test_a_cell_of_a_notebook_that_is_run_twice():
    """A class that is defined again replaces the earlier class.

    Existing scenes keep the earlier class.
    """
    first, second = made(name="again"), made(name="again")
    scene = Scene(law=first)
    assert type(Scene(law="again").parts.law) is first
    assert type(Scene(law=second).parts.law) is second
    assert type(Scene(law="again").parts.law) is second
    assert type(scene.with_(normal_stress="constant").parts.law) is first
    axes = [Axis("b_over_a", [2.0])]
    study = Study(name="n", title="t", base=scene, axes=axes, measure=LinearStability())
    assert type(study.scene(0).parts.law) is first


def test_two_parts_of_one_scene_share_no_field():
    other = made(name="gripping", grip=number(1.0, "", "1", "another"))
    with pytest.raises(
        InvalidValue, match="parts = 'gripping, sticky' have fields with the same name"
    ):
        Scene(law=other, dynamics=Sticky)


@pytest.mark.parametrize("name", ["status", "slip", "steady_friction", "a_over_b_minus_a"])
def test_a_field_that_would_be_mistaken_in_a_file(name):
    part = made(name="mistaken", **{name: number(1.0, "", "1", "another")})
    with pytest.raises(InvalidValue, match=f"field '{name}' is already used for another quantity"):
        study_of("n", LinearStability(), Axis("phi", [60]), base=Scene(law=part))


@dataclass(frozen=True)
class Held(Measure):
    """Measure that returns fields of user-defined parts."""

    name = "held"
    primary_output = "held"
    variables = {"held": ()}  # noqa: RUF012
    typical_rhs_evaluations = 1

    def compute(self, scene, integrator):
        grip = getattr(scene.parts.dynamics, "grip", 0.0)
        return Outcome(Status.OK, {"held": grip + 10.0 * scene.as_dict().get("is_odd", False)})


def test_parts_along_zipped_axes_reach_the_workers(cluster, tmp_path):
    """User-defined parts along zipped axes are sent to the workers.

    Fields of cells without the part are missing in the results.
    """
    study = study_of(
        "zipped",
        Held(),
        Axis(
            "case",
            {
                "ours": {"inertia": True},
                "mine": {"dynamics": Sticky, "grip": 5.0},
                "odd": {"law": Doubled, "is_odd": True, "loading": Steplike},
            },
        ),
        Axis("b_over_a", [2.0, 3.0]),
    )
    here = run(study)
    assert here.held.isel(b_over_a=0).values.tolist() == [0.0, 5.0, 10.0]
    assert here.dynamics.values.tolist() == ["", "sticky", ""]
    assert here.law.values.tolist() == ["slip", "slip", "doubled"]
    np.testing.assert_array_equal(here.grip, [np.nan, 5.0, np.nan])
    np.testing.assert_array_equal(here.is_odd, [np.nan, np.nan, 1.0])
    assert here.grip.attrs["units"] == "m"
    assert here.dynamics.attrs["long_name"] == (
        "force that balances the spring in addition to friction"
    )
    there = run(study, client=cluster, output=tmp_path)
    have_same_numbers(rsfstudy.open(tmp_path / "zipped.nc"), here)
    have_same_numbers(there, here)


def test_overrides_by_class_whatever_their_order():
    study = Study(name="n", title="t", base=Scene(), axes=[Axis("b_over_a", [2.0])], measure=Held())
    for other in (study.with_(factor=[1.0, 2.0], law=Doubled),
                  study.with_(law=[Doubled]).with_(factor=[1.0, 2.0])):  # fmt: skip
        assert {cell.scene.factor for cell in other.cells()} == {1.0, 2.0}
        assert other.describe()["overrides"]["law"] in ("doubled", ["doubled"])
    with pytest.raises(
        InvalidValue, match="override 'factor' is unknown. It must be the name of an axis, a scene"
    ):
        study.with_(factor=[1.0])


# ---- figures ------------------------------------------------------------------------------------
def squares(dataset, axes):
    axes.plot(dataset.held.values.ravel() ** 2)
    axes.set_title("squares")


def test_panels_draw():
    """A figure is stored under the name of its study.

    The labels and units come from the description of the measure.
    """
    figure = Figure([Panel(x="phi", y="held", facet=["law"]), squares])
    axes = [Axis("law", ["slip", "slowness"]), Axis("phi", [60, 70])]
    study = Study(name="n", title="t", base=Scene(), axes=axes, measure=Held(), plot=figure)
    dataset = run(study)
    assert json.loads(dataset.attrs["declaration"])["plot"] == "n"
    slip, slowness, own = plots.draw_figure(dataset, study.plot).axes
    assert (slip.get_title(), slowness.get_title(), own.get_title()) == (
        "Slip law",
        "Slowness law",
        "squares",
    )
    assert slip.get_xlabel().endswith(r"$\phi$ (degree)")
    np.testing.assert_array_equal(slip.lines[0].get_ydata(), dataset.held.sel(law="slip"))
