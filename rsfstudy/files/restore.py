"""Rebuilds a study from the declaration in its results. A declaration is plain data: no code from
the results file is run.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from types import ModuleType
from typing import Any

import msgspec
import xarray as xr

from rsfstudy import measures, reduce
from rsfstudy.axes.axis import Axis
from rsfstudy.declare import catalogue
from rsfstudy.declare.figure import figure_name
from rsfstudy.declare.names import names
from rsfstudy.declare.study import Study
from rsfstudy.errors import DataError, InvalidValue, brief
from rsfstudy.files import contents, loadings
from rsfstudy.files.contents import (
    Declaration,
    PlainAxis,
    PlainMeasure,
    PlainReduction,
    refused,
    restored,
)
from rsfstudy.files.lattice import coordinates
from rsfstudy.measures import Measure
from rsfstudy.reduce import Reduction
from rsfstudy.rig import reductions as _of_rigs  # noqa: F401  # to be found by its name
from rsfstudy.rig.laboratory import Laboratory
from rsfstudy.slider.registry import SLOTS, Own, by_class
from rsfstudy.vocabulary import coverage

_NAME_IT = "Name the file that declares it: --study FILE (study=)."


def study_of(results: xr.Dataset, file: str | Path | None = None) -> Study:
    """The study that made a dataset, from the declaration in it; where it uses code of the user,
    from the file that declares the study. Parts of a named study's own are those of rsfstudy.
    """
    declared = contents.declaration(results)
    if file is None and declared.name in names() and contents.own_part(declared):
        file = declared.name
    for axis in declared.axes:
        points = results.sizes.get(axis["dimension"])
        declared_points = len(contents.axis(axis))
        if declared_points != points:
            rule = f"has {declared_points} points in the declaration, and {points} in the file"
            raise refused(axis["dimension"], rule)
    held = loadings.held(results)
    if file is None and has_own_code(results):
        rule = "is a user's own, and code is never taken from a results file"
        remedy, named_in = _NAME_IT, contents.provenance(results)["declared_in"]
        if named_in:
            remedy += f" It was {brief(named_in)}."
        name, value = contents.own_part(declared, held) or ("measure", declared.measure["name"])
        raise InvalidValue(name, value, rule, remedy=remedy)
    named = None if file is None else catalogue.load(str(file))
    if named and named.name != declared.name:
        rule = f"declares the study {named.name!r}, and the results are of {declared.name!r}"
        raise InvalidValue("study", str(file), rule)
    study = from_declaration(declared, held, named)
    _check_lattice(study, results)
    return study


def has_own_code(results: xr.Dataset) -> bool:
    """True where code of the user decided a dataset; loadings, which it holds, are data."""
    if contents.provenance(results)["fingerprint"]["own_code"] == "none":
        return False
    held = loadings.held(results)
    return not held or contents.own_part(contents.declaration(results), held) is not None


def own_figure(results: xr.Dataset, file: str | Path | None = None) -> Any:
    """The figure that a user wrote for a dataset, from the file that declares the study. The file
    that the dataset names is not run unasked, because the results may come from a stranger.

    Raises
    ------
    InvalidValue
        Where no file is given, or it has no such figure.
    """
    name, named_in = contents.declaration(results).plot, contents.provenance(results)["declared_in"]
    if file is None:
        remedy = f"Name the file that declares it: --study {named_in or 'FILE'}."
        raise InvalidValue("plot", name, "is no figure of rsfstudy", remedy=remedy)
    study = catalogue.load(str(file))
    if study.name != results.attrs["id"] or figure_name(study.plot, study.name) != name:
        rule = f"does not draw {name!r} of {results.attrs['id']!r}"
        raise InvalidValue("study", str(file), rule)
    return None if isinstance(study.plot, str) else study.plot


def _check_lattice(study: Study, results: xr.Dataset) -> None:
    """Refuse results whose axes differ from those in their declaration."""
    ours, dims = xr.Dataset(coords=coordinates(study)), results["status"].dims
    if dims != study.dimensions:
        raise refused("status", f"lies along {dims}, not the axes of the declaration")
    for name in study.dimensions:
        if ours[name].values.tolist() != results[name].values.tolist():
            raise refused(name, "is not that axis of the declaration")


def from_declaration(
    declared: Declaration, held: Mapping[str, Own], of_its_own: Study | None = None
) -> Study:
    """The study with this declaration.

    Parameters
    ----------
    declared : Declaration
    held : mapping of str to Stated
        Loadings of the user's own, by name.
    of_its_own : Study, optional
        Where to take the measure, the reductions and parts of the slider from, if they are
        not part of rsfstudy; the measure with the plain fields that the declaration states.

    Raises
    ------
    InvalidValue
        Where its measure or a reduction is not part of rsfstudy.
    DataError
        Where the declaration makes no study, naming the part.
    """
    parts = msgspec.structs.asdict(declared)
    own = {**_own_parts(of_its_own), **held}
    parts["base"] = contents.scene(declared.base, own)
    if of_its_own is None:
        parts["measure"] = measure(declared.measure, "declaration.measure")
        parts["reductions"] = [
            _reduction(described, f"declaration.reductions[{number}]")
            for number, described in enumerate(declared.reductions)
        ]
    else:
        for name in ("reductions", "declared_in"):
            parts[name] = getattr(of_its_own, name)
        kind = of_its_own.measure
        stated = {name: v for name, v in declared.measure.items() if name in kind.plain_fields}
        parts["measure"] = kind.with_(**stated)
    try:
        parts["axes"] = [_axis(axis, own) for axis in declared.axes]
        if declared.laboratory is not None:
            parts["laboratory"] = _laboratory(declared.laboratory)
        return Study(**parts)
    except InvalidValue as error:
        raise refused("declaration", f"makes no study ({error})") from error


def _own_parts(study: Study | None) -> Mapping[str, Own]:
    """Parts that a user wrote, by name: those of the study, and all others defined in the files
    that were loaded with it.
    """
    others = {name: part for slot in SLOTS for name, part in slot.own.items()}
    return {} if study is None else {**others, **study.own_parts}


def _axis(described: PlainAxis, own: Mapping[str, Own]) -> Axis:
    named = contents.axis(described)
    rows = [by_class(row, own) for row in named.rows]
    return named.with_rows(rows, named.units, named.drawn)


def _laboratory(stated: Mapping[str, float]) -> Laboratory:
    unknown = sorted(set(stated) - {field.name for field in fields(Laboratory)})
    if unknown:
        raise refused(f"declaration.laboratory.{unknown[0]}", "is unknown")
    return Laboratory(**stated)


def measure(described: PlainMeasure, path: str) -> Measure:
    """The measure with this description, which stands at `path` in a file."""
    values: dict[str, Any] = dict(described)
    kind = _kind("measure", Measure, measures, values.pop("name"))
    given = dict(kind.restored_fields(values, path))
    if isinstance(values.get("measure"), Mapping):
        given["measure"] = measure(values.pop("measure"), f"{path}.measure")
    made: Measure = restored(values, kind, path, **given)
    return made


def _reduction(described: PlainReduction, path: str) -> Reduction:
    values: dict[str, Any] = dict(described)
    if values["kind"] == "spread":  # what a range of a part of a coordinate was called
        values |= {"kind": "range", "over": values.pop("on", "")}
    kind = _kind("reduction", Reduction, reduce, values.pop("kind"))
    made: Reduction = restored(values, kind, path)
    return made


def _kind(what: str, base: Any, package: ModuleType, name: str) -> Any:
    """The class of rsfstudy that is derived from `base` and has a name in declarations; those in
    the files of named studies are looked for where their package has none.
    """
    for module in pkgutil.iter_modules(package.__path__):
        importlib.import_module(f"{package.__name__}.{module.name}")
    if name not in _kinds(base):
        for study in names():
            catalogue.load(study)
    kinds = _kinds(base)
    if name not in kinds:
        rule = "is not part of rsfstudy"
        raise InvalidValue(what, name, rule, choices=kinds, remedy=_NAME_IT)
    return kinds[name]


def _kinds(base: Any) -> dict[str, Any]:
    """The concrete classes of rsfstudy that are derived from `base`, by their names in
    declarations.
    """
    found: dict[str, Any] = {}
    for kind in base.__subclasses__():
        found |= _kinds(kind)
        name = vars(kind).get("name") or vars(kind).get("kind")
        if name and kind.__module__.partition(".")[0] == __name__.partition(".")[0]:
            found[name] = kind
    return found


def headline(dataset: xr.Dataset) -> str | None:
    """The number a dataset is about: what its measure says, or the first that was measured in each
    cell, where the measure is a user's own; None where no cell has a plain number.
    """
    cells = set(dataset["status"].dims)
    plain = [
        str(name)
        for name, values in dataset.data_vars.items()
        if set(values.dims) == cells
        and values.dtype.kind == "f"
        and coverage(str(name)) == "modelResult"
    ]
    try:
        described = contents.declaration(dataset).measure
        stated = measure(described, "declaration.measure").headline
    except (DataError, InvalidValue):
        stated = ""
    return stated if stated in plain else next(iter(plain), None)
