"""Fits of friction parameters to records, as users ask for them; and what laboratories tabulate."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from numbers import Real
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.api import study_runs
from rsfstudy.axes import Axis
from rsfstudy.defaults import FIT_BUDGET as BUDGET
from rsfstudy.error_boundary import error_boundary
from rsfstudy.errors import InvalidValue
from rsfstudy.fitting import (
    LOW_PASS_ORDERS,
    MEAN,
    TRAILING_MEAN,
    FitWindow,
    LoadingStep,
    Record,
    check_free_parameters,
    noise_variance,
    parameters_of_law,
)
from rsfstudy.measures import Fit
from rsfstudy.motion import COMPILED, DEFAULT_RTOL, SCIPY, Accuracy, is_engine_installed
from rsfstudy.reductions import Range
from rsfstudy.rig import Rig, convert_to_si, is_friction_stiffness
from rsfstudy.slider import Scene
from rsfstudy.study import Study

#: What is looked for unless something else is asked for, of those that any of the laws has.
DEFAULT_FREE_PARAMETERS = (
    "a",
    "b",
    "b1",
    "b2",
    "slip_distance",
    "slip_distance_2",
    "mu_star",
    "trend1",
)
#: Those of which a law has its own, and what is said of them.
_EVOLUTION_EFFECT_PARAMETERS = ("b", "b1", "b2")
_STATE_PARAMETERS_REMEDY = (
    "One state has b; two states have b1, b2, slip_distance and slip_distance_2."
)
#: Slip distance to begin with, as part of the load point displacement that is fitted after a step.
_SLIP_DISTANCE_GUESS_OVER_DISPLACEMENT = 0.05
#: Largest number of windows.
_MAX_WINDOWS = 1000
#: Jumps of displacement back, relative to its noise and to its changes nearby, and to its extent,
#: that are a new zero; and rows from which noise is known.
(
    _MIN_DISPLACEMENT_RESET_OVER_NOISE,
    _MIN_DISPLACEMENT_RESET_OVER_EXTENT,
    _MIN_ROWS_FOR_NOISE_ESTIMATE,
) = 10.0, 0.01, 20
#: Shortest of several windows, as a part of what follows a step.
_SHORTEST_WINDOW_FRACTION = 0.5
#: First guesses of a scene: those of a record take their place.
_INITIAL_SCENE_FIELDS = {"a": 0.01, "mu_star": 0.6, "normal_stress": "constant"}
_INITIAL_FIELDS_OF_ONE_STATE_LAW = {"b_over_a": 1.2}
_INITIAL_FIELDS_OF_TWO_STATE_LAW = {"b1_over_a": 0.9, "b2_over_a": 0.3, "length_ratio": 10.0}


@error_boundary
def fit(
    record: Record | Sequence[Record],
    rig: Rig | None = None,
    *,
    laws: Sequence[str] = ("slip", "slowness"),
    free: Sequence[str] = (),
    steps: Sequence[int] = (),
    together: bool = False,
    before: Any = 0.0,
    after: Any = 0.0,
    windows: int = 1,
    noise: str = "ar",
    loading: str = "steps",
    averaging: Any = None,
    low_pass: str = "",
    posterior: int = 0,
    stiffness: Any = None,
    slip_distance: Any = None,
    engine: str | type | None = None,
    rtol: float = DEFAULT_RTOL,
    budget: int = BUDGET,
    workers: int = 0,
    command: str = "rsfstudy.fit",
    **scene: Any,
) -> xr.Dataset:
    """The friction parameters that a record tells, with errors that count correlated noise.

    Parameters
    ----------
    record : Record or sequence of Record
        As `rsfstudy.read_record` gives it.
    rig : Rig, optional
        Its stiffness is that of the machine, its slip distance the first guess.
    laws : sequence of str
        State evolution laws, a fit by each.
    free : sequence of str
        What to look for: ``a``, ``b`` (``b1``, ``b2`` and ``slip_distance_2`` of laws with two
        states), ``slip_distance``, ``mu_star``, ``stiffness``, ``alpha``, ``law_exponent`` (of
        "family"), ``step_time``, and ``trend1``, ``trend2`` and so on. Each law is fitted with
        those that it has. If none is given, a, all b and slip distances, ``mu_star`` and
        ``trend1``.
    steps : sequence of int
        Numbers of the steps to fit, from 1; all of them, if none is given. ``record.steps()``
        lists them.
    together : bool
        Fit these steps, of all records, as one: with one a, b and slip distance, and friction
        before it, trends and time of its own for each step (``mu_star_1``, ``mu_star_2``).
    before, after : quantity
        Load point displacement that is fitted around each ("100 um"); 0: all up to the next step,
        and half the way back to the one before.
    windows : int
        Number of windows, from half of what follows each step to all of it. The range of each
        parameter among them is told beside its standard error (``_windows``): where that is more,
        something else than noise is in the record, a trend that is none of those fitted, say.
    noise : str
        "ar" (autoregressive, of an order that a criterion chooses), "ar1" and so on, or "white":
        errors by the usual formula, in which the load point has no noise either.
    loading : {"steps", "recorded"}
        The load point as its steps say, or as it was recorded, and normal stress with it where that
        is no constant of the scene (``normal_stress="imposed"``).
    averaging : quantity, optional
        Time over which the data logger averaged friction about each row ("1 s", a plain number is
        in s); "trailing 1 s" if the average ends at the row. The model is averaged in the same way.
    low_pass : str, optional
        Low-pass filter that friction passed, with its corner frequency: "first_order 2 Hz",
        "butterworth_2 2 Hz" or "butterworth_4 2 Hz". The model passes through the same filter.
    posterior : int
        Draws from the posterior (``posterior``, along ``draw``), by emcee, with flat priors between
        the bounds of the search and the noise as the fit found it. A chain of some 1,000 to 10,000
        motions: where the budget is spent before it is 50 autocorrelation times long, the fit ends
        as ``work_budget_spent``.
    stiffness : quantity, optional
        Of the machine, where no rig states it: over normal stress ("1.6e-3 1/um", a plain number
        is in 1/um), or in MPa/um. Stiffness in MPa/um is divided by the mean normal stress in the
        window before each step. The first guess, if ``free`` names it. In a joint fit it is that of
        the first window, and the other windows follow by their normal stress.
    slip_distance : quantity, optional
        First guess ("10 um", a plain number is in um); by default a twentieth of the way after the
        step. Five others are tried, a tenth to ten times as long.
    engine, rtol, budget, workers
        As in `rsfstudy.run`; the engine is "compiled" where that is installed.
    command : str
        What to note in the history.
    **scene
        Other fields of the scene: what is not looked for, as in ``alpha=0.3`` beside
        ``normal_stress="imposed"``, or ``a=0.01`` where ``free`` leaves it out.

    Returns
    -------
    xarray.Dataset
        By law, and by step and record where there are several: each parameter with its standard
        error (``_stderr``), the ends of its 95 % interval (``_low``, ``_high``) and its numerical
        error (``_error``); ``a_minus_b``; ``covariance`` and ``correlation``; what the noise is
        (``noise_size``, ``noise_order``, ``effective_samples``, ``whiteness``); the window; along
        the rows of the record, ``fitted_friction``, ``residual`` and ``innovation``, NaN outside
        the window. Lengths are in um, rates in um/s. ``status`` is ``not_identified`` if the record
        does not constrain a parameter, and ``errors_not_valid`` if the values stand but their
        standard errors do not; ``message`` gives the reason. ``dataset.rsf.table()``,
        ``.rsf.plot()``, ``.rsf.scene``, ``.rsf.rig`` and ``.rsf.sample_parameters()`` say more.

    Raises
    ------
    InvalidValue
        For parameters that no law has, a law of which none is named, no stiffness, records without
        steps, steps outside of the record, a load point that moves back, and alpha at constant
        normal stress.

    Warns
    -----
    IncompleteWarning
        Where a fit failed.

    Examples
    --------
    >>> record = rsfstudy.read_record("record.csv", normal_stress="20 MPa")
    >>> fit = rsfstudy.fit(record, stiffness="1.6e-3 1/um", laws=["slip"], after="250 um")
    >>> fit.rsf.table()
    """
    if "law" in scene:
        remedy = f"Write laws={np.atleast_1d(scene['law']).tolist()}."
        raise InvalidValue("law", scene["law"], "is given as laws, each fitted", remedy=remedy)
    records: tuple[Any, ...] = (record,) if isinstance(record, Record | str) else tuple(record)
    for one in records:
        if not isinstance(one, Record):
            remedy = "Make one by rsfstudy.read_record."
            raise InvalidValue("record", one, "is no record", remedy=remedy)
    records = tuple(_add_normal_stress_of_rig(one, rig) for one in records)
    numbers = _select_step_numbers(records, steps)
    guess = _guess_slip_distance(records[0], rig, numbers[0], slip_distance)
    if "alpha" in scene:
        scene = {"normal_stress": "imposed", **scene}
    if "alpha" in free:
        _check_normal_stress_changes_for_alpha(records, loading, numbers)
        scene = {"normal_stress": "imposed", **scene}
    ratio, machine = _initial_stiffness(rig, stiffness, free, records)
    if machine:
        _check_normal_stress_is_compressive(records, numbers)
        ratio = machine / FitWindow(records[0], numbers[0]).mean_normal_stress_before_step
    first = _initial_scene(laws, scene, ratio * guess)
    sought = _free_parameters(free, laws, first)
    there = tuple((one.name, n) for one in records for n in numbers if n <= len(one.loading_steps))
    measure = Fit(
        records=records,
        free=sought,
        slip_distance_guess=guess,
        slip_distance_2_guess=10.0 * guess,
        step=numbers[0],
        together=there if together else (),
        before=_to_micrometres("before", before),
        after=_to_micrometres("after", after),
        noise=noise,
        loading=loading,
        filter=_describe_filter(averaging, low_pass),
        posterior=posterior,
        machine_stiffness=machine,
    )
    axes = [Axis("law", list(laws))]
    if len(records) > 1 and not together:
        axes.append(Axis("record", [one.name for one in records]))
    if len(numbers) > 1 and not together:
        axes.append(Axis("step", list(numbers)))
    reductions = []
    if not isinstance(windows, int) or not 1 <= windows <= _MAX_WINDOWS:
        rule = f"must be a whole number from 1 to {_MAX_WINDOWS:,}"
        raise InvalidValue("windows", windows, rule)
    if windows > 1:
        axes.append(Axis("part", np.linspace(1.0, _SHORTEST_WINDOW_FRACTION, windows).tolist()))
        reductions = [Range(f"{n}_windows", n, over="part") for n in measure.parameters]
    chosen: Any = engine
    if engine is None:
        chosen = COMPILED if is_engine_installed(COMPILED) else SCIPY
    study = Study(
        name="fit",
        title="Friction parameters of a record",
        base=first,
        axes=axes,
        measure=measure,
        reductions=reductions,
        plot="fits",
        accuracy=Accuracy(rtol, budget, engine=chosen),
    )
    return study_runs.run(
        study, workers=workers, output=None, progress=False, keep_going=True, command=command
    )


def _select_step_numbers(records: Sequence[Record], steps: Sequence[int]) -> tuple[int, ...]:
    """Numbers of the steps to fit, from 1: those stated, or all.

    Steps that lie outside of their record are refused, and a load point that does not move forward.
    """
    for record in records:
        _check_displacement_was_not_reset(record)
    count = max(len(one.loading_steps) for one in records)
    if not count:
        remedy = "State them: record.with_steps([(begins, ends, before, after)])."
        rule = "has no step of load point velocity or normal stress"
        raise InvalidValue("record", records[0].name, rule, remedy=remedy)
    numbers = tuple(steps) or tuple(range(1, count + 1))
    for number in numbers:
        if not 1 <= number <= count:
            rule = f"is not the number of a step: the record has {count}"
            raise InvalidValue("steps", number, rule)
        for record in records:
            for step in record.loading_steps[number - 1 : number]:
                _check_step_can_be_fitted(record, number, step)
    return numbers


def _check_displacement_was_not_reset(record: Record) -> None:
    """Raise ``InvalidValue`` if the load point displacement was reset to zero.

    A reset appears as a large backward jump between two rows.
    """
    time, moved = record.time, record.columns["displacement"]
    jumps = np.diff(moved)
    row = int(np.argmin(jumps))
    noise = (
        math.sqrt(noise_variance(time, moved)) if len(time) > _MIN_ROWS_FOR_NOISE_ESTIMATE else 0.0
    )
    beside = np.abs(np.delete(jumps[max(row - 5, 0) : row + 6], min(row, 5))).max(initial=0.0)
    back = -float(jumps[row]) > max(
        _MIN_DISPLACEMENT_RESET_OVER_NOISE * beside,
        _MIN_DISPLACEMENT_RESET_OVER_NOISE * noise,
        _MIN_DISPLACEMENT_RESET_OVER_EXTENT * np.ptp(moved),
    )
    if record.specified_steps is None and back:
        rule = f"falls back between two rows at {time[row + 1]:g} s in {record.name}, as a load "
        rule += "point does that is set to zero again"
        remedy = f"Fit its parts, as in record.window({time[0]:g}, {time[row]:g}), or add the "
        remedy += "offset to the later rows."
        raise InvalidValue("displacement", f"{jumps[row]:.4g} um", rule, remedy=remedy)


def _check_step_can_be_fitted(record: Record, step_number: int, step: LoadingStep) -> None:
    time, moved = record.time, record.columns["displacement"]
    if not time[0] < step.start <= step.end < time[-1]:
        rule = f"is stated outside of {record.name}, {time[0]:g} to {time[-1]:g} s"
        remedy = "State steps in s, by the clock of the record: record.with_steps([...])."
        raise InvalidValue(f"step {step_number}", tuple(step), rule, remedy=remedy)
    if min(step.velocity_before, step.velocity_after) < 0.0 or not moved[-1] > np.interp(
        step.end, time, moved
    ):
        told = (
            f"{step.velocity_before:.4g} um/s before step {step_number}, "
            f"{step.velocity_after:.4g} um/s after it"
        )
        rule = "must grow: a load point moves forward"
        remedy = "Reverse its sign, or say which column is which: --columns (columns=)."
        raise InvalidValue("displacement", told, rule, remedy=remedy)


def _check_normal_stress_changes_for_alpha(
    records: Sequence[Record], loading_kind: str, step_numbers: Sequence[int]
) -> None:
    """Raise ``InvalidValue`` if alpha is fitted but normal stress is constant."""
    for record in records:
        stress = record.columns.get("normal_stress", np.zeros(1))
        steps = [
            record.loading_steps[n - 1] for n in step_numbers if n <= len(record.loading_steps)
        ]
        by_steps = loading_kind == "steps" and any(step.stress_ratio != 1.0 for step in steps)
        if not by_steps and not (loading_kind == "recorded" and np.ptp(stress) > 0.0):
            rule = "needs a normal stress that changes: "
            rule += f"that of {record.name} has no step among those that are fitted"
            remedy = "Leave alpha out, name a step of normal stress (steps=), or follow the "
            remedy += "recorded normal stress with --loading recorded (loading=)."
            raise InvalidValue("free", "alpha", rule, remedy=remedy)


def _guess_slip_distance(
    record: Record, rig: Rig | None, step_number: int, stated_slip_distance: Any
) -> float:
    """Slip distance to begin with, in um."""
    if stated_slip_distance is not None:
        return _to_micrometres("slip_distance", stated_slip_distance)
    if rig is not None:
        return float(rig.slip_distance * 1e6)
    begins = record.loading_steps[step_number - 1].start
    moved = record.columns["displacement"]
    return float(
        _SLIP_DISTANCE_GUESS_OVER_DISPLACEMENT * (moved[-1] - np.interp(begins, record.time, moved))
    )


def _initial_stiffness(
    rig: Rig | None,
    stated_stiffness: Any,
    free_parameters: Sequence[str],
    records: Sequence[Record],
) -> tuple[float, float]:
    """Return the initial stiffness of the fit, in the units that the user chose.

    Returns
    -------
    ratio : float
        Stiffness divided by normal stress in 1/um. The ratio is 0 if the stiffness of the machine
        is known.
    machine : float
        Stiffness of the machine in Pa/um, or 0 if the ratio is known.
    """
    if stated_stiffness is None:
        if rig is not None and rig.stiffness is not None:
            return 0.0, float(rig.stiffness * 1e-6)
        if "stiffness" in free_parameters:
            return 1e-3, 0.0
        remedy = "Give --stiffness (stiffness=), as in '1.6e-3 /um', "
        remedy += "or look for it: --free (free=)."
        raise InvalidValue("stiffness", None, "is needed, and not stated", remedy=remedy)
    over_stress = isinstance(stated_stiffness, Real) or is_friction_stiffness(stated_stiffness)
    if isinstance(stated_stiffness, Real):
        found = float(stated_stiffness)
    else:
        found = (
            convert_to_si("stiffness", stated_stiffness, "1/m" if over_stress else "Pa/m") * 1e-6
        )
    if not found > 0.0:
        raise InvalidValue("stiffness", stated_stiffness, "must be positive")
    if over_stress:
        return found, 0.0
    for record in records:
        if "normal_stress" not in record.columns:
            remedy = "Give --normal-stress (normal_stress of read_record), or stiffness in 1/um."
            rule = f"needs a normal stress, and {record.name} has none"
            raise InvalidValue("stiffness", stated_stiffness, rule, remedy=remedy)
    return 0.0, found


def _check_normal_stress_is_compressive(
    records: Sequence[Record], step_numbers: Sequence[int]
) -> None:
    """Raise ``InvalidValue`` if the normal stress before a step is not positive."""
    for record in records:
        for number in step_numbers:
            if number > len(record.loading_steps):
                continue
            stress = FitWindow(record, number).mean_normal_stress_before_step
            if not stress > 0.0:
                rule = f"must be positive before step {number} of {record.name}, in Pa"
                remedy = "Compression is positive: reverse the sign, as in columns={"
                remedy += "'normal_stress': ('heading', 'MPa', -1.0)}."
                raise InvalidValue("normal_stress", stress, rule, remedy=remedy)


def _add_normal_stress_of_rig(record: Record, rig: Rig | None) -> Record:
    """Return the record with the normal stress of the rig if it has none of its own."""
    if rig is None or "normal_stress" in record.columns:
        return record
    stress = np.full(len(record), float(rig.normal_stress))
    return replace(record, columns={**record.columns, "normal_stress": stress})


def _initial_scene(laws: Sequence[str], scene_fields: Mapping[str, Any], stiffness: float) -> Scene:
    effects = (
        _INITIAL_FIELDS_OF_TWO_STATE_LAW
        if str(laws[0]).startswith("two_")
        else _INITIAL_FIELDS_OF_ONE_STATE_LAW
    )
    return Scene(
        **{
            **_INITIAL_SCENE_FIELDS,
            **effects,
            "law": laws[0],
            "stiffness": stiffness,
            **scene_fields,
        }
    )


def _free_parameters(
    stated_parameters: Sequence[str], laws: Sequence[str], scene: Scene
) -> tuple[str, ...]:
    """Parameters to look for: those stated, each of which some law has, or those of all laws."""
    free = tuple(stated_parameters) or DEFAULT_FREE_PARAMETERS
    check_free_parameters(free)
    own = {law: parameters_of_law(scene.with_(law=law), free) for law in laws}
    shared = tuple(name for name in free if any(name in names for names in own.values()))
    for name in stated_parameters:
        if name not in shared:
            rule = f"is no parameter with {' or '.join(f'law={law!r}' for law in laws)}"
            remedy = (
                _STATE_PARAMETERS_REMEDY
                if name in (*_EVOLUTION_EFFECT_PARAMETERS, "slip_distance_2")
                else ""
            )
            raise InvalidValue("free", name, rule, remedy=remedy)
    for law, names in own.items():
        if not names or (
            {*_EVOLUTION_EFFECT_PARAMETERS} & {*free}
            and not {*_EVOLUTION_EFFECT_PARAMETERS} & {*names}
        ):
            rule = f"names no {'evolution effect' if names else 'parameter'} of law={law!r}"
            raise InvalidValue("free", free, rule, remedy=_STATE_PARAMETERS_REMEDY)
    return shared


def _describe_filter(averaging: Any, low_pass: str) -> str:
    """Return a string that names the filter and its size in s or Hz.

    The string is the argument that the measure expects. The string is empty if the user passes
    neither ``averaging`` nor ``low_pass``.
    """
    if averaging is not None and low_pass:
        remedy = "Pass `averaging=` or `low_pass=`."
        raise InvalidValue("low_pass", low_pass, "cannot follow an averaging", remedy=remedy)
    if averaging is not None:
        kind, size = MEAN, averaging
        if isinstance(size, str) and size.startswith("trailing "):
            kind, size = TRAILING_MEAN, size.removeprefix("trailing ")
        seconds = float(size) if isinstance(size, Real) else convert_to_si("averaging", size, "s")
    elif low_pass:
        kind, _, size = str(low_pass).partition(" ")
        if kind not in LOW_PASS_ORDERS:
            remedy = "Write it as in 'butterworth_2 2 Hz'."
            choices = [*LOW_PASS_ORDERS]
            raise InvalidValue("low_pass", low_pass, "is unknown", choices=choices, remedy=remedy)
        seconds = convert_to_si("low_pass", size, "1/s")
    else:
        return ""
    return f"{kind} {seconds!r}"


def _to_micrometres(argument_name: str, value: Any) -> float:
    return (
        float(value)
        if isinstance(value, int | float)
        else convert_to_si(argument_name, value, "m") * 1e6
    )
