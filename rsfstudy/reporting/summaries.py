"""Summaries of datasets for commands, reports and notebooks.

The main function is ``build_summary_tables_and_sentences``. A summary consists of tables, mappings
and sentences.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.fitting import EVENT_QUANTITIES
from rsfstudy.formatting import read_flag_meanings
from rsfstudy.reporting import fit_tables, tables
from rsfstudy.reporting.tables import (
    MAX_CELLS_SHOWN,
    TextTable,
    format_number_or_dash,
    format_units,
)
from rsfstudy.slider import Scene
from rsfstudy.storage import is_of_single_scene, read_json_attribute, read_scene_fields

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
        The summary of a study includes the primary output and the reductions. The summary of a
        motion includes the peak friction, the peak slip rate, the stability of the scene and the
        events.
    """
    if fit_tables.is_fit(dataset):
        yield from fit_tables.summarise_fits(dataset)
    elif not is_of_single_scene(dataset):
        yield tables.build_primary_output_table(dataset)
        yield from tables.reduction_tables(dataset)
        yield {
            f"no {name}": why
            for name, why in tables.find_refusal_reasons_of_reductions(dataset).items()
        }
        yield from filter(None, [tables.note_on_norms_near_load_velocity(dataset)])
    elif is_motion(dataset):
        yield summarise_motion(dataset)
        try:
            yield describe_stability(dataset.rsf.scene)
            yield build_events_table(dataset.rsf.events())
        except InvalidValue as error:  # The scene has a user-defined part.
            yield f"neither its stability nor its events: {error}"
    else:
        yield tables.build_single_scene_result_table(dataset)


def build_motion_tables_and_sentences(
    motion: xr.Dataset, scene: Scene, catalogue: xr.Dataset
) -> list[SummaryTableOrSentence]:
    """Return the summary of a motion.

    Parameters
    ----------
    motion : xarray.Dataset
        Motion from ``rsfstudy.simulate``.
    scene : Scene
        Scene of the motion.
    catalogue : xarray.Dataset
        Events of the motion.

    Returns
    -------
    list of (mapping of str to str, str, or TextTable)
        Peak values of the motion, stability of the scene, and table of the events.
    """
    return [summarise_motion(motion), describe_stability(scene), build_events_table(catalogue)]


def is_motion(dataset: xr.Dataset) -> bool:
    """Return True if a dataset is a motion or a part of a motion.

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
    """Describe the contents and the provenance of a dataset.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, or a dataset of one scene.

    Returns
    -------
    dict of str to str
        Descriptions of the scene or the lattice, the command, the versions and the status.
    """
    if not is_of_single_scene(dataset):
        return tables.describe_study_origin(dataset)
    about, scene = dataset.attrs, read_scene_fields(dataset)
    fields = {n: v for n, v in scene.items() if n not in ("segments", "samples")}
    rig = read_json_attribute(dataset, "laboratory") if "laboratory" in about else {}
    return {
        **tables.describe_scene_and_rig_fields("scene", fields, rig),
        "made by": about.get("history", "unknown"),
        "with": about.get("source", "unknown"),
        "status": f"{about['status']} {about.get('message', '')}".strip(),
    }


def summarise_motion(dataset: xr.Dataset) -> dict[str, str]:
    """Summarise a motion by its duration and its peak values.

    Parameters
    ----------
    dataset : xarray.Dataset
        Motion from ``rsfstudy.simulate``, in any units.

    Returns
    -------
    dict of str to str
        Duration, peak friction, peak slip rate, and friction at the end. If the motion has neither
        inertia nor radiation damping and exceeds the instability norm, the time at which the motion
        exceeds the norm is included.
    """
    time, friction = dataset["time"], dataset["friction_coefficient"]
    over_reference = (10.0 ** dataset["log10_slip_rate"]).assign_attrs(scale="V_*")
    rate, unit = dataset.get("slip_rate", over_reference), format_units(time)
    per = f" {format_units(rate)}"
    told = {"duration": f"{float(time[-1]):.6g} {unit}"}
    for name, values, of in (("peak friction", friction, ""), ("peak slip rate", rate, per)):
        peak = int(np.argmax(values.values))
        told[name] = f"{float(values[peak]):.6g}{of} after {float(time[peak]):.6g} {unit}"
    if "instability_time" in dataset:
        since = f"{float(dataset['instability_time']):.6g} {unit}"
        told["beyond the instability norm"] = f"no physics after {since}"
    told["friction at the end"] = f"{float(friction[-1]):.6g}"
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
    ratio = f"{scene.stiffness_ratio:.4g} of the critical"
    return f"stiffness is {ratio}: steady sliding at V_* is {sliding}"


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
    for place in range(min(count, MAX_CELLS_SHOWN)):
        event = event_catalogue.isel(event=place)
        row = {
            words: format_number_or_dash(float(event[name]), ".4g") for name, words in heads.items()
        }
        rows.append({**row, "cut": flags[int(event["cut"])].replace("_", " ")})
    caption = f"Events {limit}"
    if count > len(rows):
        caption += f" ({len(rows)} of {count:,}: dataset.rsf.events() has all, with their errors)"
    return TextTable(rows, caption)
