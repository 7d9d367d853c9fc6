"""Function that fits friction parameters to laboratory records.

The main function, ``fit()``, checks the arguments, builds a study with the measure ``Fit``, and
runs the study.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from numbers import Real
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.api import study_runs
from rsfstudy.api.record_checks import (
    check_alpha_can_be_fitted,
    check_displacement_is_not_slip,
    check_displacement_was_not_reset,
    check_step_can_be_fitted,
)
from rsfstudy.axes import Axis
from rsfstudy.defaults import Defaults
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import raise_only_rsfstudy_errors
from rsfstudy.execution import ProgressCallback
from rsfstudy.fitting import (
    LOW_PASS_ORDERS,
    MEAN,
    PARAMETERS,
    TRAILING_MEAN,
    FitWindow,
    Record,
    check_free_parameters,
    compute_weighted_mean,
    parameters_of_law,
    split_window_number,
)
from rsfstudy.formatting import format_count_with_noun
from rsfstudy.measures import Fit
from rsfstudy.motion import Accuracy, Engine
from rsfstudy.reductions import Range
from rsfstudy.rig import Rig, convert_to_si
from rsfstudy.slider import Scene
from rsfstudy.study import Study

#: Default free parameters. If a law does not have a parameter, the fits of this law ignore the
#: parameter.
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
#: Parameters that exist only for laws with a certain number of states. The second constant is a
#: sentence for error messages about these parameters.
_EVOLUTION_EFFECT_PARAMETERS = ("b", "b1", "b2")
_REMEDY_FOR_WRONG_STATE_PARAMETERS = (
    "Laws with one state have the parameter b. Laws with two states have b1, b2, slip_distance "
    "and slip_distance_2."
)
#: Value of the argument ``stiffness`` that requests a measurement of the stiffness in the records.
STIFFNESS_OPTION_FROM_RECORD = "from record"
#: Initial guess of the slip distance, as a fraction of the load point displacement after a step.
_SLIP_DISTANCE_GUESS_OVER_DISPLACEMENT = 0.05
#: Maximum value of the argument ``windows``.
_MAX_FIT_WINDOW_COUNT = 1000
#: Length of the shortest window of a fit, as a fraction of the load point displacement after a
#: step.
_SHORTEST_FIT_WINDOW_FRACTION = 0.5
#: Initial values of the scene fields in a fit. Values that the user passes take precedence.
_INITIAL_GUESS_OF_SCENE_FIELDS = {"a": 0.01, "mu_star": 0.6, "normal_stress": "constant"}
_INITIAL_GUESS_FOR_ONE_STATE_LAWS = {"b_over_a": 1.2}
_INITIAL_GUESS_FOR_TWO_STATE_LAWS = {"b1_over_a": 0.9, "b2_over_a": 0.3, "length_ratio": 10.0}


@raise_only_rsfstudy_errors
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
    rtol: float = Accuracy.DEFAULT_RTOL,
    budget: int = Defaults.FIT_EVALUATION_BUDGET,
    workers: int = 0,
    progress: bool | ProgressCallback = True,
    command: str = "rsfstudy.fit",
    **scene: Any,
) -> xr.Dataset:
    """Fit friction parameters to a laboratory record.

    By default, each step of load point velocity or normal stress is fitted separately. A fit is
    computed for each state evolution law. The standard errors account for correlated noise.

    Parameters
    ----------
    record : Record or sequence of Record
        Records to fit, as returned by ``rsfstudy.read_record``.
    rig : Rig, optional
        Rig that recorded the data. The stiffness of the rig is the stiffness of the model, and the
        slip distance of the rig is the initial guess. If a record contains no normal stress, the
        normal stress of the rig is used.
    laws : sequence of str, default: ("slip", "slowness")
        State evolution laws. A separate fit is computed for each law.
    free : sequence of str, optional
        Names of the free parameters: ``a``, ``b`` (``b1``, ``b2`` and ``slip_distance_2`` for laws
        with two states), ``slip_distance``, ``mu_star``, ``stiffness``, ``alpha``, ``law_exponent``
        (for the law "family"), ``step_time``, ``trend1``, ``trend2`` and so on. If a law does not
        have a parameter, the fits of this law ignore the parameter. By default, the free parameters
        are ``a``, the ``b`` and the slip distance of each state, ``mu_star`` and ``trend1``.
    steps : sequence of int, optional
        Numbers of the steps to fit, starting from 1. ``record.steps()`` lists the steps. By
        default, all steps are fitted.
    together : bool, default: False
        If True, the steps of all records are fitted jointly. In a joint fit, all steps share the
        same ``a``, ``b`` and slip distance. The friction before the step, the trend and the step
        time are fitted separately for each step, and the names of these parameters end with the
        number of the step, such as ``mu_star_1`` and ``mu_star_2``.
    before, after : quantity, default: 0.0
        Load point displacement over which the record is fitted before and after each step, such as
        "100 um", or a number in um. If ``before`` is 0, the window begins halfway between the
        previous step and this step, or at the beginning of the record. If ``after`` is 0, the
        window ends at the next step, or at the end of the record.
    windows : int, default: 1
        Number of windows for each fit. The windows include between 50 and 100 % of the displacement
        after the step. For each parameter, ``<name>_windows`` is the range of the parameter over
        the windows. A range that is larger than the standard error indicates that the record
        contains a signal that the model does not describe, such as a trend.
    noise : str, default: "ar"
        Noise model: "ar" for an autoregressive process with an automatic order, "ar1", "ar2" and so
        on for a fixed order, or "white" for white noise. With "white", the standard errors follow
        from the formula for uncorrelated noise, and the fit assumes that the load point
        displacement has no noise.
    loading : {"steps", "recorded"}, default: "steps"
        Loading of the model. "steps" uses constant velocities between the steps. "recorded" uses
        the recorded load point displacement, and the recorded normal stress if the normal stress of
        the scene is not constant (``normal_stress="imposed"``).
    averaging : quantity, optional
        Time over which the data logger averaged friction around each row, such as "1 s", or a
        number in s. Use "trailing 1 s" if the average ends at the row. The same average is applied
        to the model. By default, the fit applies the filter with which `read_record` filtered the
        record, or assumes that friction was not averaged.
    low_pass : str, optional
        Low-pass filter that was applied to friction, with its corner frequency: "first_order 2 Hz",
        "butterworth_2 2 Hz" or "butterworth_4 2 Hz". The same filter is applied to the model. By
        default, the fit assumes that friction was not filtered.
    posterior : int, default: 0
        Number of draws from the posterior distribution. The draws are stored in the variable
        ``posterior`` along the dimensions ``draw`` and ``parameter``, and the coordinate
        ``parameter_units`` contains their units. Sampling requires emcee. The prior of each
        parameter is uniform between the bounds of the parameter in the fit, and the noise model is
        fixed. A Markov chain requires the integration of about 1,000 to 10,000 motions. If the
        budget is exceeded before the chain is 50 autocorrelation times long, the status of the fit
        is ``work_budget_spent``.
    stiffness : quantity, optional
        Stiffness of the machine. The argument is required if no rig is passed. The stiffness is a
        string in MPa/um, a string in 1/um such as "1.6e-3 1/um" (stiffness divided by normal
        stress), or a number in 1/um. With "from record", the stiffness is measured in the locked
        portions of the records (see ``Record.stiffness``), and the standard errors of the
        parameters include the standard error of this stiffness. Stiffness in MPa/um is divided by
        the mean normal stress in the window before each step. If ``free`` contains "stiffness", the
        argument is the initial guess. In a joint fit, a stiffness in 1/um applies to the first
        window. For the other windows, the stiffness is scaled by the ratio of the normal stresses.
    slip_distance : quantity, optional
        Initial guess of the slip distance, such as "10 um", or a number in um. The fit tries five
        values from a tenth to ten times this guess. By default, the initial guess is 5 % of the
        load point displacement after the step.
    engine : {"scipy", "python", "compiled"} or type, optional
        Engine that integrates the motions (see ``rsfstudy.run``). The default is "compiled" if
        Numba is installed, and "scipy" otherwise.
    rtol : float, default: 1e-7
        Relative tolerance of the motions.
    budget : int, default: 50,000,000
        Largest number of right-hand side evaluations of a fit.
    workers : int, default: 0
        Number of worker processes. With 0, the fits are computed in the current process.
    progress : bool or callable, default: True
        If True, show the number of finished fits on standard error if the fits take longer than
        20 s. A function is called with the number of finished fits, the number of all fits,
        and the estimated remaining time in s, or None.
    command : str, default: "rsfstudy.fit"
        Command line to record in the history of the dataset.
    **scene : object
        Fixed values of other fields of the scene. For example, ``alpha=0.3`` selects imposed normal
        stress with the coefficient 0.3, and ``a=0.01`` fixes the direct effect if ``free`` does not
        contain "a".

    Returns
    -------
    xarray.Dataset
        Fits along the dimension ``law``, and along ``step`` and ``record`` if there are several
        steps or records. Lengths are in um and velocities in um/s.

        - For each parameter, ``<name>`` is the best-fit value, ``<name>_stderr`` is the standard
          error, ``<name>_ci_low`` and ``<name>_ci_high`` are the ends of the 95 % confidence
          interval, and ``<name>_error`` is the numerical error. ``a_minus_b`` is the difference of
          a and b.
        - ``covariance`` and ``correlation`` have the dimensions ``parameter`` and
          ``other_parameter``.
        - The noise is described by ``noise_sd`` (standard deviation), ``noise_order``, ``n_eff``
          (effective sample size) and ``p_value``, the p-value of a test for remaining
          autocorrelation. ``aic`` is the Akaike information criterion.
        - ``fitted_friction``, ``residual`` and ``whitened_residual`` have the dimension ``row`` and
          are NaN outside the window.
        - ``status`` is ``not_identified`` if the record does not constrain a parameter, and
          ``errors_not_valid`` if only the standard errors are invalid. ``message`` contains the
          reason.

    Raises
    ------
    InvalidValue
        If a parameter does not exist in any of the laws, if a law has no free parameter, or if the
        stiffness is missing. The error is also raised if a record has no steps, if a step is
        outside the record, if the load point moves backwards, or if ``alpha`` is fitted to steps at
        constant normal stress.

    Warns
    -----
    IncompleteWarning
        If a fit failed.

    See Also
    --------
    rsfstudy.read_record : Read the record of an experiment.

    Notes
    -----
    The accessor provides further results: ``dataset.rsf.fit_table()`` returns a table of the
    parameters, ``dataset.rsf.plot()`` plots the fits, ``dataset.rsf.scene`` and ``dataset.rsf.rig``
    return the fitted scene and rig, and ``dataset.rsf.sample_parameters()`` draws samples of the
    parameters. ``rsfstudy.measures.Fit`` describes the model.

    Examples
    --------
    Create a synthetic record of a velocity step from 1 to 10 um/s, and fit a, b and the slip
    distance. The motions of the fit take several seconds without Numba.

    >>> import numpy as np
    >>> from rsfstudy import fit, read_record
    >>> time = np.arange(-20.0, 41.0)
    >>> displacement = np.where(time < 0.0, 1.0, 10.0) * time
    >>> decay = np.exp(-np.maximum(displacement, 0.0) / 10.0)
    >>> change = (0.01 - 0.015 * (1.0 - decay)) * np.log(10.0)
    >>> friction = 0.6 + np.where(time > 0.0, change, 0.0)
    >>> record = read_record({"time": time, "displacement": displacement, "friction": friction})
    >>> record.steps()["velocity_after"].values.round(3)
    array([10.])
    >>> fits = fit(record, stiffness="0.1 1/um", slip_distance="10 um", laws=["slip"],
    ...            free=["a", "b"], noise="white")  # doctest: +SKIP
    >>> fits["b"].values.round(3)  # doctest: +SKIP
    array([0.015])
    """
    if "law" in scene:
        remedy = f"Write laws={np.atleast_1d(scene['law']).tolist()}."
        raise InvalidValue(
            "law",
            scene["law"],
            "cannot be set, because one fit is computed for each law",
            remedy=remedy,
        )
    records: tuple[Any, ...] = (record,) if isinstance(record, Record | str) else tuple(record)
    for one in records:
        if not isinstance(one, Record):
            remedy = "Read a record with rsfstudy.read_record."
            raise InvalidValue("record", one, "must be a Record", remedy=remedy)
    records = tuple(_add_normal_stress_of_rig(one, rig) for one in records)
    numbers = _select_step_numbers(records, steps)
    guess = _guess_slip_distance(records[0], rig, numbers[0], slip_distance)
    if "alpha" in scene:
        scene = {"normal_stress": "imposed", **scene}
    if "alpha" in free:
        check_alpha_can_be_fitted(records, loading, numbers)
        scene = {"normal_stress": "imposed", **scene}
    ratio, machine, stiffness_error = _find_initial_stiffness(rig, stiffness, free, records)
    if machine:
        _check_normal_stress_is_compressive(records, numbers)
        ratio = machine / FitWindow(records[0], numbers[0]).mean_normal_stress_before_step
    if "stiffness" not in free:
        check_displacement_is_not_slip(records, numbers, ratio, machine)
    first = _build_initial_scene(laws, scene, ratio * guess)
    sought = _select_free_parameters(free, laws, first)
    there = tuple((one.name, n) for one in records for n in numbers if n <= len(one.loading_steps))
    measure = Fit(
        records=records,
        free=sought,
        slip_distance_guess=guess,
        slip_distance_2_guess=10.0 * guess,
        step=numbers[0],
        together=there if together else (),
        before=_convert_to_micrometres("before", before),
        after=_convert_to_micrometres("after", after),
        noise=noise,
        loading=loading,
        filter=_find_common_filter(records, _format_filter_as_string(averaging, low_pass)),
        posterior=posterior,
        machine_stiffness=machine,
        stiffness_relative_stderr=stiffness_error,
    )
    axes = [Axis("law", list(laws))]
    if len(records) > 1 and not together:
        axes.append(Axis("record", [one.name for one in records]))
    if len(numbers) > 1 and not together:
        axes.append(Axis("step", list(numbers)))
    reductions = []
    if not isinstance(windows, int) or not 1 <= windows <= _MAX_FIT_WINDOW_COUNT:
        rule = f"must be a whole number from 1 to {_MAX_FIT_WINDOW_COUNT:,}"
        raise InvalidValue("windows", windows, rule)
    if windows > 1:
        axes.append(Axis("part", np.linspace(1.0, _SHORTEST_FIT_WINDOW_FRACTION, windows).tolist()))
        reductions = [Range(f"{n}_windows", n, over="part") for n in measure.parameters]
    chosen: Any = engine
    if engine is None:
        chosen = Engine.COMPILED if Engine.is_installed(Engine.COMPILED) else Engine.SCIPY
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
    fits = study_runs.run(
        study, workers=workers, output=None, progress=progress, keep_going=True, command=command
    )
    if posterior:
        units = [PARAMETERS[split_window_number(name)[0]].units for name in measure.parameters]
        about = {"long_name": "units of the parameter"}
        fits = fits.assign_coords(parameter_units=("parameter", np.array(units, object), about))
        # The draws of different parameters have different units.
        del fits["posterior"].attrs["units"]
    processing = [f"{one.name}: {text}" for one in records for text in one.processing]
    return fits.assign_attrs({"processing": "; ".join(processing)} if processing else {})


def _select_step_numbers(records: Sequence[Record], steps: Sequence[int]) -> tuple[int, ...]:
    """Return the numbers of the steps to fit, and check the steps.

    By default, all steps are fitted.

    Raises
    ------
    InvalidValue
        If the records have no steps, if a step is outside its record, or if the load point does not
        move forward.
    """
    for record in records:
        check_displacement_was_not_reset(record)
    count = max(len(one.loading_steps) for one in records)
    if not count:
        remedy = "Specify the steps: record.with_steps([(begins, ends, before, after)])."
        rule = "has no step in load point velocity or normal stress"
        raise InvalidValue("record", records[0].name, rule, remedy=remedy)
    numbers = tuple(steps) or tuple(range(1, count + 1))
    for number in numbers:
        if not 1 <= number <= count:
            found = format_count_with_noun(count, "step")
            owner = "the record has" if len(records) == 1 else "the records have at most"
            rule = f"must contain step numbers from 1 to {count}, because {owner} {found}"
            raise InvalidValue("steps", number, rule)
        for record in records:
            for step in record.loading_steps[number - 1 : number]:
                check_step_can_be_fitted(record, number, step)
    return numbers


def _guess_slip_distance(
    record: Record, rig: Rig | None, step_number: int, stated_slip_distance: Any
) -> float:
    """Return the initial guess of the slip distance in um."""
    if stated_slip_distance is not None:
        return _convert_to_micrometres("slip_distance", stated_slip_distance)
    if rig is not None:
        return float(rig.slip_distance * 1e6)
    begins = record.loading_steps[step_number - 1].start
    moved = record.columns["displacement"]
    return float(
        _SLIP_DISTANCE_GUESS_OVER_DISPLACEMENT * (moved[-1] - np.interp(begins, record.time, moved))
    )


def _find_initial_stiffness(
    rig: Rig | None,
    stated_stiffness: Any,
    free_parameters: Sequence[str],
    records: Sequence[Record],
) -> tuple[float, float, float]:
    """Return the initial stiffness of the fit.

    A stiffness that the user passes in MPa/um is returned as the second value, ``machine``. A
    stiffness in 1/um is returned as the first value, ``ratio``.

    Returns
    -------
    ratio : float
        Stiffness divided by normal stress in 1/um. The ratio is 0 if ``machine`` is positive.
    machine : float
        Stiffness of the machine in Pa/um. The value is 0 if ``ratio`` is positive.
    relative_stderr : float
        Relative standard error of a stiffness that is measured in the records, or 0.
    """
    if stated_stiffness == STIFFNESS_OPTION_FROM_RECORD:
        return _measure_stiffness_in_records(records)
    if stated_stiffness is None:
        if rig is not None and rig.stiffness is not None:
            return 0.0, float(rig.stiffness * 1e-6), 0.0
        if "stiffness" in free_parameters:
            return 1e-3, 0.0, 0.0
        remedy = "Pass a value, for example --stiffness '1.6e-3 /um' (in Python, stiffness=), or "
        remedy += "fit it by adding stiffness to the free parameters (--free, or free= in Python)."
        raise InvalidValue("stiffness", None, "is required", remedy=remedy)
    over_stress = isinstance(stated_stiffness, Real) or Rig.is_stiffness_in_friction_per_length(
        stated_stiffness
    )
    if isinstance(stated_stiffness, Real):
        found = float(stated_stiffness)
    else:
        found = (
            convert_to_si("stiffness", stated_stiffness, "1/m" if over_stress else "Pa/m") * 1e-6
        )
    if not found > 0.0:
        raise InvalidValue("stiffness", stated_stiffness, "must be positive")
    if over_stress:
        return found, 0.0, 0.0
    for record in records:
        if "normal_stress" not in record.columns:
            remedy = (
                "Pass the normal stress with --normal-stress (in Python, normal_stress= of "
                "read_record), or pass the stiffness in 1/um."
            )
            rule = f"requires a normal stress, but the record {record.name!r} has none"
            raise InvalidValue("stiffness", stated_stiffness, rule, remedy=remedy)
    return 0.0, found, 0.0


def _measure_stiffness_in_records(records: Sequence[Record]) -> tuple[float, float, float]:
    """Measure the stiffness in the locked portions of the records.

    Returns
    -------
    ratio, machine, relative_stderr : float
        Stiffness in the format of ``_find_initial_stiffness``.

    Raises
    ------
    InvalidValue
        If the records contain no locked portion.
    """
    stressed = all("normal_stress" in record.columns for record in records)
    name = "machine_stiffness" if stressed else "stiffness"
    tables = [record.stiffness() for record in records]
    found = np.array([(float(of[name]), float(of[f"{name}_stderr"])) for of in tables])
    found = found[np.isfinite(found).all(axis=1)]
    if not len(found):
        rule = "requires a part of the record in which the fault is locked, such as the reloading "
        rule += "after a hold, an unloading and reloading, or the initial loading"
        remedy = (
            "Pass the stiffness as a quantity, for example '1.6e-3 1/um', or fit it by adding "
            "stiffness to the free parameters (--free, or free= in Python)."
        )
        raise InvalidValue("stiffness", STIFFNESS_OPTION_FROM_RECORD, rule, remedy=remedy)
    value, stderr = compute_weighted_mean(*found.T)
    return (0.0, value, stderr / value) if stressed else (value, 0.0, stderr / value)


def _check_normal_stress_is_compressive(
    records: Sequence[Record], step_numbers: Sequence[int]
) -> None:
    """Raise ``InvalidValue`` if normal stress is not positive.

    The function checks the mean normal stress before each step.
    """
    for record in records:
        for number in step_numbers:
            if number > len(record.loading_steps):
                continue
            stress = FitWindow(record, number).mean_normal_stress_before_step
            if not stress > 0.0:
                rule = f"must be positive before step {number} of {record.name}, in Pa"
                remedy = "Compression is positive. To reverse the sign, pass columns={"
                remedy += "'normal_stress': ('heading', 'MPa', -1.0)}."
                raise InvalidValue("normal_stress", stress, rule, remedy=remedy)


def _add_normal_stress_of_rig(record: Record, rig: Rig | None) -> Record:
    """Add the normal stress of the rig to a record without normal stress."""
    if rig is None or "normal_stress" in record.columns:
        return record
    stress = np.full(len(record), float(rig.normal_stress))
    return replace(record, columns={**record.columns, "normal_stress": stress})


def _build_initial_scene(
    laws: Sequence[str], scene_fields: Mapping[str, Any], stiffness: float
) -> Scene:
    """Return the scene with the initial guesses of all parameters."""
    effects = (
        _INITIAL_GUESS_FOR_TWO_STATE_LAWS
        if str(laws[0]).startswith("two_")
        else _INITIAL_GUESS_FOR_ONE_STATE_LAWS
    )
    return Scene(
        **{
            **_INITIAL_GUESS_OF_SCENE_FIELDS,
            **effects,
            "law": laws[0],
            "stiffness": stiffness,
            **scene_fields,
        }
    )


def _select_free_parameters(
    stated_parameters: Sequence[str], laws: Sequence[str], scene: Scene
) -> tuple[str, ...]:
    """Return the free parameters that exist in at least one of the laws.

    Raises
    ------
    InvalidValue
        If none of the laws has a parameter that the user requests, or if a law has no free
        parameter. The error is also raised if the free parameters include evolution effects
        (``b``, ``b1`` or ``b2``), but a law has none of these evolution effects.
    """
    free = tuple(stated_parameters) or DEFAULT_FREE_PARAMETERS
    check_free_parameters(free)
    own = {law: parameters_of_law(scene.with_(law=law), free) for law in laws}
    shared = tuple(name for name in free if any(name in names for names in own.values()))
    for name in stated_parameters:
        if name not in shared:
            rule = f"must only contain parameters of {' or '.join(f'law={law!r}' for law in laws)}"
            remedy = (
                _REMEDY_FOR_WRONG_STATE_PARAMETERS
                if name in (*_EVOLUTION_EFFECT_PARAMETERS, "slip_distance_2")
                else ""
            )
            raise InvalidValue("free", name, rule, remedy=remedy)
    for law, names in own.items():
        if not names or (
            {*_EVOLUTION_EFFECT_PARAMETERS} & {*free}
            and not {*_EVOLUTION_EFFECT_PARAMETERS} & {*names}
        ):
            rule = f"contains no {'evolution effect' if names else 'parameter'} of law={law!r}"
            raise InvalidValue("free", free, rule, remedy=_REMEDY_FOR_WRONG_STATE_PARAMETERS)
    return shared


def _format_filter_as_string(averaging: Any, low_pass: str) -> str:
    """Return the friction filter in the string format used by ``Fit``.

    The string contains the type of the filter and its duration in s or frequency in Hz. The string
    is empty if the user passes neither ``averaging`` nor ``low_pass``.
    """
    if averaging is not None and low_pass:
        remedy = "Omit one of the two."
        raise InvalidValue("low_pass", low_pass, "cannot be combined with averaging", remedy=remedy)
    if averaging is not None:
        kind, size = MEAN, averaging
        if isinstance(size, str) and size.startswith("trailing "):
            kind, size = TRAILING_MEAN, size.removeprefix("trailing ")
        seconds = float(size) if isinstance(size, Real) else convert_to_si("averaging", size, "s")
    elif low_pass:
        kind, _, size = str(low_pass).partition(" ")
        if kind not in LOW_PASS_ORDERS:
            remedy = "Pass, for example, 'butterworth_2 2 Hz'."
            choices = [*LOW_PASS_ORDERS]
            raise InvalidValue("low_pass", low_pass, "is unknown", choices=choices, remedy=remedy)
        seconds = convert_to_si("low_pass", size, "1/s")
    else:
        return ""
    return f"{kind} {seconds!r}"


def _find_common_filter(records: Sequence[Record], stated_filter: str) -> str:
    """Return the filter that was applied to the friction of all records.

    If a record was filtered when it was read, the function uses the filter of the record.
    """
    filters = {record.filter for record in records if record.filter}
    if not filters:
        return stated_filter
    if stated_filter:
        remedy = "Omit averaging= and low_pass=, or read the record without filter=."
        raise InvalidValue(
            "filter",
            stated_filter,
            "cannot be applied, because the record was read with filter=",
            remedy=remedy,
        )
    if len({record.filter for record in records}) > 1:
        remedy = "Read all records with the same filter=, or fit them separately."
        raise InvalidValue(
            "filter", sorted(filters), "must be the same for all records", remedy=remedy
        )
    return filters.pop()


def _convert_to_micrometres(argument_name: str, value: Any) -> float:
    """Convert a length to um. A number without units is assumed to be in um."""
    return (
        float(value)
        if isinstance(value, int | float)
        else convert_to_si(argument_name, value, "m") * 1e6
    )
