"""Functions that summarise datasets for commands, reports and notebooks.

The main function is ``build_summary_tables_and_sentences``. A summary consists of tables, mappings
and sentences.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.fitting import EVENT_QUANTITIES
from rsfstudy.formatting import read_flag_meanings
from rsfstudy.reporting import dataset_origin_descriptions, fit_tables
from rsfstudy.reporting.fit_summaries import summarise_fits
from rsfstudy.reporting.hold_summaries import is_hold_table, summarise_holds
from rsfstudy.reporting.lattice_tables import build_primary_output_table
from rsfstudy.reporting.reduction_tables import (
    build_reduction_tables,
    find_reasons_of_refused_reductions,
    format_notes_on_reductions,
)
from rsfstudy.reporting.text_tables import (
    MAX_ROWS_IN_THINNED_TABLE,
    TextTable,
    build_single_scene_result_table,
    format_number_or_dash,
    format_units,
)
from rsfstudy.slider import Scene, SceneFields
from rsfstudy.storage import StoredDataset

SummaryTableOrSentence = TextTable | Mapping[str, str] | str


def build_summary_tables_and_sentences(dataset: xr.Dataset) -> Iterator[SummaryTableOrSentence]:
    """Yield the summary of a dataset.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, fits, or a dataset of one scene.

    Yields
    ------
    TextTable, mapping of str to str, or str
        Items of the summary. The summary of a study includes the primary output and the reductions.
        The summary of a motion includes the peak friction, the peak slip rate, the stability of the
        scene and the events.
    """
    if fit_tables.contains_fits(dataset):
        yield from summarise_fits(dataset)
    elif StoredDataset(dataset).table_contents:
        yield from _summarise_table(dataset)
    elif not StoredDataset(dataset).is_of_single_scene:
        yield build_primary_output_table(dataset)
        yield from build_reduction_tables(dataset)
        yield from format_notes_on_reductions(dataset, find_reasons_of_refused_reductions(dataset))
        yield from filter(
            None, [dataset_origin_descriptions.format_note_on_low_instability_norms(dataset)]
        )
    elif is_motion_dataset(dataset):
        yield summarise_motion(dataset)
        try:
            yield describe_stability(dataset.rsf.scene)
            yield from format_notes_on_default_mu_star(dataset.rsf.scene)
            yield build_events_table(dataset.rsf.events())
        except InvalidValue as error:  # The scene has a user-defined part.
            yield f"stability and events are unavailable: {error}"
    else:
        yield build_single_scene_result_table(dataset)


def _summarise_table(dataset: xr.Dataset) -> Iterator[SummaryTableOrSentence]:
    """Yield the summary of a table whose rows are, for example, holds, events or steps."""
    if is_hold_table(dataset):
        yield from summarise_holds(dataset)
        return
    if "cut" in dataset and "slip_rate_threshold" in dataset.attrs:
        yield build_events_table(dataset)
        return
    scalars = [name for name, values in dataset.data_vars.items() if not values.dims]
    if scalars:
        yield {str(name): _format_table_value(dataset[name]) for name in scalars}
    (along,) = dataset.dims
    names = [along, *(n for n, values in dataset.variables.items() if n != along and values.dims)]
    heads = {n: dataset[n].attrs.get("units", "1") for n in names if n in dataset.variables}
    heads = {n: str(n) if unit == "1" else f"{n} ({unit})" for n, unit in heads.items()}
    count = dataset.sizes[along]
    shown = min(count, MAX_ROWS_IN_THINNED_TABLE)
    rows = [
        {head: _format_table_value(dataset[n][row]) for n, head in heads.items()}
        for row in range(shown)
    ]
    yield TextTable(rows, f"first {shown} of {count:,} rows" if shown < count else "")


def _format_table_value(value: xr.DataArray) -> str:
    """Format a number or a string for a table. NaN is formatted as a dash."""
    if value.dtype.kind == "f":
        return format_number_or_dash(float(value), ".6g")
    return str(value.item())


def build_motion_tables_and_sentences(
    motion: xr.Dataset, scene: Scene, event_catalogue: xr.Dataset
) -> list[SummaryTableOrSentence]:
    """Return the summary of a motion.

    Parameters
    ----------
    motion : xarray.Dataset
        Motion from ``rsfstudy.simulate``.
    scene : Scene
        Scene of the motion.
    event_catalogue : xarray.Dataset
        Events of the motion.

    Returns
    -------
    list of (mapping of str to str, str, or TextTable)
        Peak values of the motion, stability of the scene, a note if the reference friction has its
        default value, and table of the events.
    """
    notes = [describe_stability(scene), *format_notes_on_default_mu_star(scene)]
    return [summarise_motion(motion), *notes, build_events_table(event_catalogue)]


def is_motion_dataset(dataset: xr.Dataset) -> bool:
    """Return True if a dataset is a motion, or a selection of times of a motion.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset to check.

    Returns
    -------
    bool
        True if the dataset has at least one time and all variables that the summary needs.
    """
    told = {"load_point_displacement", "friction_coefficient", "log10_slip_rate", "shear_stress"}
    return dataset.sizes.get("time", 0) > 0 and {*told, "slip"} <= set(dataset.variables)


def describe_dataset_origin(dataset: xr.Dataset) -> dict[str, str]:
    """Describe the scene or the lattice of a dataset, and the provenance of the dataset.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, or a dataset of one scene.

    Returns
    -------
    dict of str to str
        Descriptions of the scene or the lattice, the command, the versions and the status.
    """
    if StoredDataset(dataset).table_contents:
        return _describe_command_and_versions(dataset)
    if not StoredDataset(dataset).is_of_single_scene:
        return dataset_origin_descriptions.describe_study_origin(dataset)
    about, scene = dataset.attrs, StoredDataset(dataset).scene_fields
    fields = {n: v for n, v in scene.items() if n not in ("segments", "samples")}
    rig = StoredDataset(dataset).read_json_attribute("laboratory") if "laboratory" in about else {}
    return {
        **dataset_origin_descriptions.describe_scene_and_rig_fields("scene", fields, rig),
        **_describe_command_and_versions(dataset),
        "status": f"{about['status']} {about.get('message', '')}".strip(),
    }


def _describe_command_and_versions(dataset: xr.Dataset) -> dict[str, str]:
    """Describe the command and the software versions that produced a dataset."""
    about = dataset.attrs
    return {
        "command": about.get("history", "unknown"),
        "software versions": about.get("source", "unknown"),
    }


def compute_duration_and_peaks_of_motion(dataset: xr.Dataset) -> dict[str, Any]:
    """Compute the duration and the peak values of a motion.

    Parameters
    ----------
    dataset : xarray.Dataset
        Motion from ``rsfstudy.simulate``, in any units.

    Returns
    -------
    dict of str to object
        Numbers by name, and the units of times and slip rates. The entry ``instability_time`` is
        None if the slip rate does not exceed the instability norm. The entry is also None if the
        motion has inertia or radiation damping.
    """
    time, friction = dataset["time"], dataset["friction_coefficient"]
    over_reference = (10.0 ** dataset["log10_slip_rate"]).assign_attrs(scale="V_*")
    rate = dataset.get("slip_rate", over_reference)
    peaks = {"friction": friction, "slip_rate": rate}
    at = {name: int(np.argmax(values.values)) for name, values in peaks.items()}
    norm = dataset.get("instability_time")
    return {
        "duration": float(time[-1]),
        "time_units": format_units(time),
        "slip_rate_units": format_units(rate),
        **{f"peak_{name}": float(values[at[name]]) for name, values in peaks.items()},
        **{f"peak_{name}_time": float(time[at[name]]) for name in peaks},
        "instability_time": None if norm is None else float(norm),
        "final_friction": float(friction[-1]),
    }


def summarise_motion(dataset: xr.Dataset) -> dict[str, str]:
    """Describe the duration and the peak values of a motion.

    Parameters
    ----------
    dataset : xarray.Dataset
        Motion from ``rsfstudy.simulate``, in any units.

    Returns
    -------
    dict of str to str
        Texts that describe the duration, the peak friction, the peak slip rate and the friction at
        the end. If a motion without inertia and without radiation damping exceeds the instability
        norm, the dictionary also describes the time at which the slip rate exceeds the norm.
    """
    found, unit = compute_duration_and_peaks_of_motion(dataset), format_units(dataset["time"])
    told = {"duration": f"{found['duration']:.6g} {unit}"}
    for name, units in (("friction", ""), ("slip_rate", f" {found['slip_rate_units']}")):
        peak, time = found[f"peak_{name}"], found[f"peak_{name}_time"]
        told[f"peak {name.replace('_', ' ')}"] = f"{peak:.6g}{units} after {time:.6g} {unit}"
    if found["instability_time"] is not None:
        since = f"{found['instability_time']:.6g} {unit}"
        told["beyond the instability norm"] = f"no physical meaning after {since}"
    told["friction at the end"] = f"{found['final_friction']:.6g}"
    return told


def describe_stability(scene: Scene) -> str:
    """Describe the stability of steady sliding at V_*.

    Parameters
    ----------
    scene : Scene
        Scene to describe.

    Returns
    -------
    str
        Sentence with the ratio of the stiffness to the critical stiffness.
    """
    sliding = "stable" if scene.stiffness_ratio > 1.0 else "unstable"
    ratio = f"{scene.stiffness_ratio:.4g} times the critical stiffness"
    return f"stiffness is {ratio}: steady sliding at V_* is {sliding}"


def format_notes_on_default_mu_star(scene: Scene) -> list[str]:
    """Return a note if the friction coefficient at V_* has its default value.

    Parameters
    ----------
    scene : Scene
        Scene to describe.

    Returns
    -------
    list of str
        Note, or an empty list if the friction coefficient differs from the default.
    """
    default = SceneFields.map_field_names_to_defaults()["mu_star"]
    if scene.mu_star != default:
        return []
    return [f"mu_star, the friction coefficient at V_*, has its default value {default:g}"]


def build_events_table(event_catalogue: xr.Dataset) -> TextTable | str:
    """Build a table of the events of a motion, without error estimates.

    Parameters
    ----------
    event_catalogue : xarray.Dataset
        Events of a motion.

    Returns
    -------
    TextTable or str
        Table of the first 24 events, or a sentence if there is no event.
    """
    limit = f"faster than {event_catalogue.attrs['slip_rate_threshold']:g} V_*"
    count = event_catalogue.sizes["event"]
    if not count:
        return f"no event {limit}"
    heads = {
        n: words for n, (_, words, _) in EVENT_QUANTITIES.items() if words and n in event_catalogue
    }
    if "peak_slip_rate" in heads:
        del heads["peak_log10_slip_rate"]
    for name, words in heads.items():
        unit = format_units(event_catalogue[name])
        heads[name] = words if unit == "1" else f"{words} ({unit})"
    flags = read_flag_meanings(event_catalogue["cut"].attrs) | {0: "-"}
    rows = []
    for place in range(min(count, MAX_ROWS_IN_THINNED_TABLE)):
        event = event_catalogue.isel(event=place)
        row = {
            words: format_number_or_dash(float(event[name]), ".4g") for name, words in heads.items()
        }
        rows.append({**row, "cut": flags[int(event["cut"])].replace("_", " ")})
    caption = f"Events {limit}"
    if count > len(rows):
        caption += (
            f" (first {len(rows)} of {count:,} events; dataset.rsf.events() returns all events "
            "and their errors)"
        )
    return TextTable(rows, caption)
