"""Summary of a dataset, whatever it is of: tables, lists and sentences, which a terminal prints,
and a page or a notebook shows.
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

TableMappingOrSentence = TextTable | Mapping[str, str] | str


def build_summary_pieces(dataset: xr.Dataset) -> Iterator[TableMappingOrSentence]:
    """The numbers of a dataset: the headline and the slopes of a study, the parameters of fits, or
    what a reader of a motion, or of another answer for one scene, looks for first.
    """
    if fit_tables.is_fit(dataset):
        yield from fit_tables.summarise_fits(dataset)
    elif not is_of_single_scene(dataset):
        yield tables.build_primary_output_table(dataset)
        yield from tables.reduction_tables(dataset)
        yield {f"no {name}": why for name, why in tables.find_refusal_reasons(dataset).items()}
        yield from filter(None, [tables.note_on_norms_near_load_velocity(dataset)])
    elif is_motion(dataset):
        yield summarise_motion(dataset)
        try:
            yield describe_stability(dataset.rsf.scene)
            yield build_events_table(dataset.rsf.events())
        except InvalidValue as error:  # a part of its scene is a user's own
            yield f"neither its stability nor its events: {error}"
    else:
        yield tables.build_scene_answer_table(dataset)


def motion_pieces(
    motion: xr.Dataset, scene: Scene, catalogue: xr.Dataset
) -> list[TableMappingOrSentence]:
    """What a reader of a motion looks for first, the stability of its scene, and its events."""
    return [summarise_motion(motion), describe_stability(scene), build_events_table(catalogue)]


def is_motion(dataset: xr.Dataset) -> bool:
    """True of a motion, or a part of one that still holds what is told of it."""
    told = {"load_point_displacement", "friction_coefficient", "log10_slip_rate", "shear_stress"}
    return dataset.sizes.get("time", 0) > 0 and {*told, "slip"} <= set(dataset.variables)


def describe_dataset_origin(dataset: xr.Dataset) -> dict[str, str]:
    """What a dataset is of, and where it comes from, by what each is."""
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
    """What a reader of a motion looks for first."""
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
    """Whether steady sliding at V_* is stable, by the stiffness."""
    sliding = "stable" if scene.stiffness_ratio > 1.0 else "unstable"
    ratio = f"{scene.stiffness_ratio:.4g} of the critical"
    return f"stiffness is {ratio}: steady sliding at V_* is {sliding}"


def build_events_table(event_catalogue: xr.Dataset) -> TextTable | str:
    """The events of a motion, without their errors."""
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
