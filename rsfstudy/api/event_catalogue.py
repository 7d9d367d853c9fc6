"""Functions that build event catalogues and detect stress drops in laboratory records."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.api.stress_records import StressRecord, read_stress_record
from rsfstudy.errors import InvalidValue, NoResultWarning
from rsfstudy.exception_conversion import find_stacklevel_of_user_code, raise_only_rsfstudy_errors
from rsfstudy.execution import build_provenance_attributes
from rsfstudy.fitting import (
    EVENT_QUANTITIES,
    MIN_SAMPLES,
    Detection,
    EventNumbers,
    read_drops,
)
from rsfstudy.netcdf_encoding import copy_with_cf_encoding
from rsfstudy.rig import RecordReadingOptions, compute_conversion_factor, convert_to_si

#: Mapping from the scale of a quantity to a variable of the record. The quantity has the units of
#: this variable.
_VARIABLE_WITH_UNITS_BY_SCALE_SYMBOL = {"D_c/V_*": "time", "D_c": "slip", "sigma_*": "shear_stress"}
#: Quantities of an event that can be computed only if displacement is known.
_QUANTITIES_REQUIRING_DISPLACEMENT = ("slip", "peak_slip_rate", "dynamic_stress_drop")
#: Meanings of the codes 0, 1, 2 and 3 of the variable ``cut``.
_MEANINGS_OF_EVENT_TRUNCATION_FLAGS = ("whole", "begins_before", "lasts_beyond", "both")

#: Comment on the peak slip rate of an event in a record.
_COMMENT_ON_PEAK_SLIP_RATE = (
    "largest mean slip rate between two samples. If its error is NaN, the sampling interval is too "
    "long to resolve the peak, and the value is a lower bound"
)

#: Limit of the ratio of the largest decrease of stress to the smallest detectable drop of stress.
#: If no drop is found and the ratio exceeds the limit, the function ``events`` emits a warning.
_SUSPICIOUS_STRESS_FALL_OVER_MIN_DROP = 10.0


def build_event_catalogue(
    measured_events: Sequence[EventNumbers], variable_attributes: Mapping[str, Mapping[Any, Any]]
) -> xr.Dataset:
    """Build a dataset from the measured quantities of events.

    Parameters
    ----------
    measured_events : sequence of (dict, int)
        Quantities of each event, and the code that describes which part of the event is missing.
        Each quantity is a value with its error. The function adds the interval since the previous
        event to each dictionary.
    variable_attributes : mapping of str to mapping
        Attributes of the variables ``time``, ``slip`` and ``shear_stress`` from which the events
        were measured.

    Returns
    -------
    xarray.Dataset
        Variables along the dimension ``event``, in the units of the measured variables. Each
        variable has an error estimate ``<name>_error``.
    """
    rows = [numbers for numbers, _cut in measured_events]
    for row, earlier in zip(rows, [{}, *rows], strict=False):
        (time, error), (before, unsure) = row["time"], earlier.get("time", (math.nan, math.nan))
        row["interval"] = time - before, error + unsure
    number = {"long_name": "number of the event", "units": "1"}
    dataset = xr.Dataset(coords={"event": ("event", np.arange(len(rows)), number)})
    for name, (scale, _heading, words) in EVENT_QUANTITIES.items():
        if rows and name not in rows[0]:
            continue
        values, errors = np.array([row[name] for row in rows]).reshape(-1, 2).T
        units = _build_units_and_scale_attributes(scale, variable_attributes)
        dataset[name] = "event", values, {"long_name": words, **units}
        of_error = {"long_name": f"error estimate of {words}", **units}
        dataset[f"{name}_error"] = "event", errors, of_error
    flags = {
        "long_name": "part of the event that is missing in the record",
        "flag_values": np.arange(len(_MEANINGS_OF_EVENT_TRUNCATION_FLAGS), dtype=np.int8),
        "flag_meanings": " ".join(_MEANINGS_OF_EVENT_TRUNCATION_FLAGS),
    }
    dataset["cut"] = (
        "event",
        np.array([cut for _numbers, cut in measured_events], dtype=np.int8),
        flags,
    )
    return copy_with_cf_encoding(
        dataset.assign_attrs(
            title="Catalogue of events",
            Conventions="CF-1.11",
            **build_provenance_attributes("rsfstudy.events"),
        )
    )


def _build_units_and_scale_attributes(
    scale_symbol: str, variable_attributes: Mapping[str, Mapping[Any, Any]]
) -> dict[str, str]:
    """Return the ``units`` and ``scale`` attributes of an event quantity.

    Times, slips and stresses have the units of the corresponding variable of the record. The units
    of a slip rate are the units of slip divided by the units of time. All other quantities are
    dimensionless.
    """
    if scale_symbol in _VARIABLE_WITH_UNITS_BY_SCALE_SYMBOL:
        source = variable_attributes[_VARIABLE_WITH_UNITS_BY_SCALE_SYMBOL[scale_symbol]]
        return {key: str(source[key]) for key in ("units", "scale") if key in source}
    if not scale_symbol or "scale" in variable_attributes["slip"]:
        return {"units": "1", **({"scale": scale_symbol} if scale_symbol else {})}
    time, slip = (variable_attributes[name].get("units") for name in ("time", "slip"))
    return {"units": f"{slip} {time}-1"} if time and slip else {}


# ---- detection of drops in records --------------------------------------------------------------


@raise_only_rsfstudy_errors
def events(
    record: Any = None,
    columns: Mapping[str, Any] | None = None,
    *,
    time: Any = None,
    displacement: Any = None,
    shear_stress: Any = None,
    normal_stress: Any = None,
    stiffness: Any = None,
    sign: int | None = None,
    **reading: Any,
) -> xr.Dataset:
    """Detect drops of shear stress in a laboratory record.

    A drop is a decrease in shear stress that is too large to be explained by the noise in the
    record.

    Parameters
    ----------
    record : str, Path, mapping, pandas.DataFrame, xarray.Dataset or Record, optional
        Path of a file, or an object in memory, as in `read_record`. The record must contain shear
        stress or friction. It must also contain time or displacement. The shear stress of a Record
        is the product of friction and normal stress, or friction if the record has no normal
        stress.
    columns : mapping of str to str or tuple, optional
        Heading and units of each column, as in `read_record`. The columns are ``time``,
        ``displacement``, ``slip`` (of the fault), ``shear_stress``, ``friction`` and
        ``normal_stress``. By default, common headings are recognised.
    time, displacement, shear_stress : array_like of shape (n,), optional
        Arrays to use instead of ``record``. If an array has the attribute ``units``, the results
        have the same units. Otherwise, the results have no attribute ``units``.
    normal_stress : quantity, optional
        Normal stress by which friction is multiplied, for example "20 MPa". Pass this argument if
        the record contains friction, but neither shear stress nor normal stress.
    stiffness : quantity, optional
        Stiffness between the fault and the point at which displacement is measured. The stiffness
        is a change of shear stress divided by a change of displacement. The value is a string such
        as "0.05 MPa/um", or a number in the units of the record. If displacement was measured at
        the load point, pass the stiffness of the rig. If displacement is the slip of the fault,
        pass ``inf``. By default, the function assumes that displacement is the slip of the fault,
        and tests this assumption.
    sign : {1, -1}, optional
        Sign of shear stress in the record. Pass -1 if shear stress in the direction of slip is
        negative. Shear stress is multiplied by the sign, so that it falls during events. The
        default is -1 if all samples of shear stress are negative, and 1 otherwise.
    **reading : object
        Options ``decimal``, ``sheet``, ``area``, ``rows``, ``begin``, ``end``, ``thin`` and
        ``filter`` of `read_record`. The filter is applied to shear stress.

    Returns
    -------
    xarray.Dataset
        Variables along the dimension ``event``, in the units of the record. ``time`` is the
        beginning of the event. If the record has no time, ``displacement`` is the displacement at
        the beginning of the event, and ``duration`` and ``interval`` are displacements. The other
        variables are ``duration``, ``interval`` (time since the previous event), ``stress_before``,
        ``stress_after``, ``static_stress_drop`` and ``cut`` (0 for complete events, 1 if the record
        begins within the event, 2 if the record ends within the event, 3 if both apply). If time
        and displacement are known, the dataset also has ``slip``, ``peak_slip_rate`` (the
        largest mean slip rate between two samples), and ``dynamic_stress_drop``. Quantities that
        are not larger than the noise are NaN. For each variable, ``<name>_error`` is the half width
        of a 95 % confidence interval. The error of ``peak_slip_rate`` is NaN if the sampling
        interval is too long to resolve the peak. In this case, the value is a lower bound. The
        scalar ``noise`` is the standard deviation of the noise, and ``smallest_drop``
        is the smallest drop that can be detected. The attribute ``sign_of_shear_stress`` contains
        the sign that was used. The attribute ``processing`` describes the selection of rows and the
        filter.

    Raises
    ------
    InvalidValue
        If the arrays differ in length, contain NaN or are too short, if time does not increase, or
        if the stiffness is not positive.

    Warns
    -----
    NoResultWarning
        If displacement does not increase faster during the drops than before and after the drops.
        In this case, ``slip``, ``peak_slip_rate`` and ``dynamic_stress_drop`` are NaN, and the
        attribute ``comment`` of ``slip`` contains the reason. The warning is also issued if no drop
        is detected although stress decreases by more than ten times ``smallest_drop``. In this
        case, the attribute ``comment`` of the dataset contains the size of the decrease and
        ``smallest_drop``.

    Notes
    -----
    At every sample, the function compares the mean stresses of two windows, one before the sample
    and one after the sample. The window lengths are 4, 8, 16 and more sampling intervals, up to a
    hundredth of the record. The noise is estimated from the most frequent differences between the
    mean stresses of neighbouring windows, because most of these differences occur during loading.
    The noise may be correlated over times that are short compared with the longest window, and
    drops may occupy up to 40 % of the record. The detection threshold corresponds to one false
    detection in 10,000 records of Gaussian noise. If sampling intervals differ by more than a
    factor of three, as in triggered bursts, the samples are first averaged over equal intervals of
    time.

    Three straight lines are then fitted to the samples before, during and after each drop. The
    intersections of the lines are the beginning and the end of the event. Stress may have its
    maximum before the beginning of the event, because the fault slips slowly before the event. To
    measure ``stress_before``, the function fits a concave function of time to the samples between
    the middle of the interval since the previous event and the middle of the drop, and computes the
    maximum of the function. In the same way, ``stress_after`` is the minimum of a convex function
    after the middle of the drop. If no concave or convex function describes these samples, fewer
    samples are used. The errors include the change of stress within a sampling interval. The
    confidence intervals of ``static_stress_drop`` contain the true difference for 93 to 100 % of
    simulated events in white noise, depending on its size and on the sampling interval. If the
    record contains events, ``noise`` is estimated from the residuals of the concave and convex
    functions.

    The probability of missing a drop of the size ``smallest_drop`` is 1 in 1,000, provided that no
    other drop is closer to the drop than the length of the longest window. If the noise is white
    and the record has at least 3,200 samples, ``smallest_drop`` is less than three standard
    deviations of the noise. If the noise is correlated, ``smallest_drop`` is larger. Spikes of
    single samples are not Gaussian noise and may cause false detections. A relaxation of stress
    within a window, for example during a hold of the load point, is also detected as a drop.

    To compute slip, the function divides shear stress by ``stiffness``, and subtracts the quotient
    from displacement. If ``stiffness`` is not passed, the function uses displacement as slip only
    if displacement increases faster during the drops than before and after the drops. The increase
    of displacement during the drops must exceed the increase in equally long intervals around the
    drops by 10 %, and by three standard deviations of the noise of displacement. The displacement
    of a load point does not pass this test. The function reads displacement a few samples before
    and after each drop, because noise in shear stress causes errors in the start and end times of
    the drop.

    Examples
    --------
    >>> import numpy as np
    >>> from rsfstudy import events
    >>> time = 0.01 * np.arange(2000)
    >>> noise = np.random.default_rng(0).normal(scale=0.01, size=2000)
    >>> catalogue = events(time=time, shear_stress=5.0 + 0.1 * (time % 5.0) + noise)
    >>> catalogue["static_stress_drop"].values.round(1)
    array([0.5, 0.5, 0.5])
    """
    options = RecordReadingOptions.from_keywords("events", reading)
    if record is None:
        given = {"time": time, "displacement": displacement, "shear_stress": shear_stress}
        read = StressRecord(given)
    else:
        read = read_stress_record(record, columns, normal_stress, options)
    given = dict(read.variables_by_name)
    if not read.has_time:
        given = given | {"time": given["displacement"], "displacement": None}
    times, stress = (
        _convert_samples_to_finite_array(name, given[name]) for name in ("time", "shear_stress")
    )
    moved = given["displacement"]
    moves = None if moved is None else _convert_samples_to_finite_array("displacement", moved)
    for name, samples in (("shear_stress", stress), ("displacement", moves)):
        if samples is not None and len(samples) != len(times):
            rule = (
                f"must have as many samples as 'time' (got {len(samples)} instead of {len(times)})"
            )
            raise InvalidValue(name, ..., rule)
    if not (np.diff(times) > 0.0).all():
        late = int(np.argmax(np.diff(times) <= 0.0)) + 1
        rule = f"must increase, but does not increase at sample {late}"
        if read.has_time:
            raise InvalidValue("time", times[late], rule)
        remedy = "A record without time requires an increasing displacement. Try thin=10."
        raise InvalidValue("displacement", times[late], rule, remedy=remedy)
    direction = _find_stress_sign(stress, sign)
    stress = direction * stress
    about = {name: dict(getattr(values, "attrs", {})) for name, values in given.items()}
    if stiffness is not None:
        if moves is None:
            raise InvalidValue(
                "stiffness", stiffness, "requires the displacement of the load point"
            )
        moves = moves - stress / _parse_stiffness(stiffness, about)
    rows, detection, is_slip = read_drops(
        times, stress, moves, check_slip=stiffness is None and not read.displacement_is_slip
    )
    for row in rows if not is_slip else ():
        row[0].update(dict.fromkeys(_QUANTITIES_REQUIRING_DISPLACEMENT, (math.nan, math.nan)))
    dataset = build_event_catalogue(rows, about | {"slip": about["displacement"]})
    if rows and not is_slip:
        why = (
            "displacement does not increase faster during the stress drops than before and "
            "after them"
        )
        dataset["slip"].attrs["comment"] = why
        remedy = (
            "Pass stiffness='0.05 MPa/um' (the stiffness of the rig), or math.inf if "
            "displacement is the slip of the fault"
        )
        warnings.warn(
            f"slip is NaN, because {why}. {remedy}",
            NoResultWarning,
            stacklevel=find_stacklevel_of_user_code(),
        )
    if "peak_slip_rate" in dataset:
        dataset["peak_slip_rate"].attrs["comment"] = _COMMENT_ON_PEAK_SLIP_RATE
    units = {key: value for key, value in about["shear_stress"].items() if key == "units"}
    dataset["noise"] = (
        (),
        detection.noise_sd,
        {"long_name": "standard deviation of the noise", **units},
    )
    words = "smallest detectable drop of shear stress (missed once in 1,000 records)"
    dataset["smallest_drop"] = ((), detection.min_detectable_drop, {"long_name": words, **units})
    dataset.attrs["sign_of_shear_stress"] = int(direction)
    if read.processing_steps:
        dataset.attrs["processing"] = "; ".join(read.processing_steps)
    if not read.has_time:
        dataset = _rename_times_to_displacements(dataset)
    if not rows and (text := _warn_if_large_stress_fall_undetected(detection)):
        dataset.attrs["comment"] = text
    return dataset


def _parse_stiffness(stiffness: Any, variable_attributes: Mapping[str, Mapping[Any, Any]]) -> float:
    """Convert the stiffness to the units of the record."""
    if isinstance(stiffness, str):
        stress, length = (
            variable_attributes[n].get("units") for n in ("shear_stress", "displacement")
        )
        if not (stress and length):
            remedy = "Pass a number in the units of shear stress divided by displacement."
            raise InvalidValue(
                "stiffness",
                stiffness,
                "cannot be converted, because the record has no units",
                remedy=remedy,
            )
        ours = compute_conversion_factor("shear_stress", stress, "Pa") / compute_conversion_factor(
            "displacement", length, "m"
        )
        return _parse_stiffness(
            convert_to_si("stiffness", stiffness, "Pa/m") / float(ours), variable_attributes
        )
    if not stiffness > 0.0:
        raise InvalidValue("stiffness", stiffness, "must be positive")
    return float(stiffness)


def _convert_samples_to_finite_array(variable_name: str, values: Any) -> np.ndarray:
    """Convert samples of a record to a finite array of shape (n,)."""
    try:
        samples = np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise InvalidValue(variable_name, values, "must be numbers") from error
    if samples.ndim != 1 or len(samples) < MIN_SAMPLES:
        rule = (
            f"must be one-dimensional with at least {MIN_SAMPLES} samples (got an array of "
            f"shape {samples.shape}), because the noise is estimated from the samples"
        )
        raise InvalidValue(variable_name, ..., rule)
    if not np.isfinite(samples).all():
        late = int(np.argmin(np.isfinite(samples)))
        raise InvalidValue(
            variable_name,
            samples[late],
            f"must be finite at all samples, but sample {late} is not finite",
        )
    return samples


def _rename_times_to_displacements(event_catalogue: xr.Dataset) -> xr.Dataset:
    """Rename the variable ``time`` to ``displacement``, for a record without times."""
    words = {
        "time": "displacement at the beginning of the event",
        "duration": "displacement during the event",
        "interval": "displacement since the beginning of the previous event",
    }
    for name, text in words.items():
        event_catalogue[name].attrs["long_name"] = text
        event_catalogue[f"{name}_error"].attrs["long_name"] = f"error estimate of {text}"
    return event_catalogue.rename({"time": "displacement", "time_error": "displacement_error"})


def _find_stress_sign(stress: np.ndarray, stated_sign: int | None) -> float:
    """Return the sign that a record uses for shear stress in the slip direction.

    If the user does not pass a sign, the sign is -1 if all samples of shear stress are negative,
    and 1 otherwise.
    """
    if stated_sign is None:
        return -1.0 if stress.max() < 0.0 else 1.0
    if stated_sign not in (-1, 1):
        raise InvalidValue("sign", stated_sign, "must be 1 or -1")
    return float(stated_sign)


def _warn_if_large_stress_fall_undetected(detection: Detection) -> str:
    """Warn if no drop is found although stress falls considerably.

    Returns
    -------
    str
        Message of the warning, or an empty string if no warning was issued.
    """
    if (
        not detection.max_moving_average_decrease
        > _SUSPICIOUS_STRESS_FALL_OVER_MIN_DROP * detection.min_detectable_drop
    ):
        return ""
    text = (
        "no drop was detected, although stress decreases by "
        f"{detection.max_moving_average_decrease:.4g} in "
        "total, which is "
        f"{detection.max_moving_average_decrease / detection.min_detectable_drop:.0f} times the "
        f"smallest detectable drop ({detection.min_detectable_drop:.4g}). The decrease "
        "is too slow or "
        "lasts for most of the record"
    )
    remedy = "Select a part of the record, or pass sign=-1 if the shear stress is negative"
    warnings.warn(f"{text}. {remedy}.", NoResultWarning, stacklevel=find_stacklevel_of_user_code())
    return text
