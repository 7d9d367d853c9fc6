"""The parts of a results file, and what each must be. A file is checked here before anything else
uses it; an error names the part that is wrong by its path, as in ``declaration.claims[3].id``.

The classes describe the layout. A missing part is never replaced by a default: the results would
then be those of another study.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from types import MappingProxyType, NoneType, UnionType
from typing import Any, TypedDict, get_args, get_origin, get_type_hints, is_typeddict

import numpy as np
import xarray as xr

from rsfstudy.declare.claims import Claim
from rsfstudy.errors import DataError, InvalidValue, brief
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.slider import fluid
from rsfstudy.slider.parts import names_of
from rsfstudy.slider.protocol import Protocol
from rsfstudy.slider.registry import SLOTS, Own, by_class, kinds_with
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status


class Attributes(TypedDict):
    """Attributes of the whole file that rsfstudy uses."""

    id: str
    title: str
    completeness: str
    reduced_despite: str


#: The fields of a scene, a part of the user's own by its name.
PlainScene = Mapping[str, float | str | bool | None]


class PlainAxis(TypedDict):
    """A dimension of the lattice: a list of values, or labels and the fields set at each."""

    dimension: str
    values: Sequence[float | str | bool] | Mapping[str, Mapping[str, float | str | bool | None]]


class PlainMeasure(TypedDict):
    """A measure; what else it holds depends on its name."""

    name: str


class PlainReduction(TypedDict):
    """A reduction; what else it holds depends on its kind."""

    kind: str
    name: str
    of: str


@dataclass(frozen=True)
class Declaration:
    """The attribute ``declaration``: the study that made the file."""

    name: str
    title: str
    summary: str
    version: int
    base: PlainScene
    axes: Sequence[PlainAxis]
    measure: PlainMeasure
    accuracy: Accuracy
    reductions: Sequence[PlainReduction]
    claims: Sequence[Claim]
    plot: str
    references: Sequence[str]
    overrides: Mapping[str, Any]


class Fingerprint(TypedDict):
    """What decided the numbers; what else it holds is only compared."""

    own_code: str


class Provenance(TypedDict):
    """The attribute ``provenance``: where the file comes from."""

    time: str
    command: str
    declared_in: str
    versions: Mapping[str, str]
    fingerprint: Fingerprint
    git: str
    machine: str


#: NumPy's kinds of numbers and texts that variables may hold, and those that must be there.
_KINDS = ("iufbOUT", "numbers or texts")
#: What the scenes of files are that were written before there was a choice of pore fluid.
_OLDER: Mapping[str, Any] = {
    **{name: None for part in fluid.PARTS.values() for name in names_of(part)},
    "fluid": "drained",
}
_OF_EVERY_LATTICE = {
    "status": ("i", "whole numbers"),
    "message": ("OUT", "texts"),
    "rhs_evaluations": ("iu", "whole numbers"),
    "wall_time": ("f", "numbers"),
}


def check(dataset: xr.Dataset) -> None:
    """Check every part of a results file that rsfstudy uses.

    Raises
    ------
    DataError
        Names the first part that is missing or wrong.
    """
    attrs = fit({"reduced_despite": "", **dataset.attrs}, Attributes, "")
    name = declaration(dataset).name
    if attrs["id"] != name or not name.isidentifier():
        raise refused("id", f"is {brief(attrs['id'])!r}, and the declared study {brief(name)!r}")
    provenance(dataset)
    for variable in _OF_EVERY_LATTICE:
        if variable not in dataset.data_vars:
            raise refused(variable, "is missing")
    digests = fit(from_json(dataset, "digests"), Mapping[str, str], "digests")
    for variable in map(str, dataset.variables):
        if variable in digests or variable in _OF_EVERY_LATTICE:  # a notebook may have added others
            _check_kind(variable, dataset[variable])
    _check_lattice(dataset)


def check_of_a_study(dataset: xr.Dataset, where: str) -> None:
    """Refuse what was asked of one scene, with what to do with it.

    Raises
    ------
    DataError
        If the dataset is a motion, a limit cycle or a critical step.
    """
    if "scene" in dataset.attrs and "declaration" not in dataset.attrs:
        title = brief(dataset.attrs.get("title", "untitled"))
        raise DataError(
            f"{where} is of one scene ({title}), not the results of a study. Open its file with "
            "xarray.open_dataset; rsfstudy.picture(dataset), or dataset.rsf.plot(), draws a motion."
        )


def declaration(dataset: xr.Dataset) -> Declaration:
    """The declaration of the study that made a dataset.

    Raises
    ------
    DataError
        If the dataset carries none, or not as rsfstudy writes it.
    """
    plain = from_json(dataset, "declaration")
    declared: Declaration = fit(plain, Declaration, "declaration")
    if provenance(dataset)["fingerprint"]["own_code"] == "none":
        scene(declared.base)
    return declared


def scene(
    plain: PlainScene,
    own: Mapping[str, Own] = MappingProxyType({}),
    path: str = "declaration.base",
) -> Scene:
    """A scene; by default the one that all cells share.

    Parameters
    ----------
    plain : mapping
        Its fields.
    own : mapping of str to type
        Its parts that are a user's own, by name.
    path : str
        Where it stands in its file.

    Raises
    ------
    DataError
        Where the fields make no scene, naming the first that does not.
    """
    parts = [part for part in by_class(plain, own).values() if isinstance(part, type | Protocol)]
    kinds = kinds_with(parts)
    values = _fitted({**_OLDER, **plain}, kinds, path)
    for name in plain:
        if name not in kinds:
            raise refused(_inside(path, name), "is unknown")
    try:
        return Scene(**by_class(values, own))
    except InvalidValue as error:
        raise refused(_inside(path, error.name), f"is refused ({error})") from error


def own_part(declared: Declaration) -> tuple[str, str] | None:
    """Slot and name of a part that the user wrote, if any cell has one."""
    rows: list[Mapping[str, Any]] = [declared.base]
    for axis in declared.axes:
        dimension, values = axis["dimension"], axis["values"]
        if isinstance(values, Mapping):
            rows += values.values()
        else:
            rows += [{dimension: value} for value in values]
    for slot in SLOTS:
        for name in {row.get(slot.name): None for row in rows}:
            if isinstance(name, str) and name not in slot.choices:
                return slot.name, name
    return None


def provenance(dataset: xr.Dataset) -> Provenance:
    """Where a dataset comes from.

    Raises
    ------
    DataError
        If the dataset does not say, or not as rsfstudy writes it.
    """
    origin: Provenance = fit(from_json(dataset, "provenance"), Provenance, "provenance")
    return origin


def from_json(dataset: xr.Dataset, name: str) -> Any:
    """What an attribute of a dataset holds as JSON; raises DataError where it does not."""
    if name not in dataset.attrs:
        raise refused(name, "is missing")
    try:
        return json.loads(dataset.attrs[name])
    except (TypeError, ValueError, RecursionError) as error:
        raise refused(name, f"is no JSON ({brief(error)})") from error


def _check_kind(name: str, values: xr.DataArray) -> None:
    """Refuse a variable that does not hold the kind of numbers or texts it must hold."""
    kinds, wanted = _OF_EVERY_LATTICE.get(name, _KINDS)
    kind = values.dtype.kind
    if kind not in kinds:
        raise refused(name, f"holds {values.dtype}, and must hold {wanted}")
    if kind == "O" and not all(isinstance(text, str) for text in values.values.flat):
        raise refused(name, f"holds objects, and must hold {wanted}")


def _check_lattice(dataset: xr.Dataset) -> None:
    """Refuse cells without coordinates, and status codes that are unknown."""
    dims = dataset["status"].dims
    for name in _OF_EVERY_LATTICE:
        if dataset[name].dims != dims:
            raise refused(name, f"lies along {dataset[name].dims}, and status along {dims}")
    for name in map(str, dims):
        if name not in dataset.coords or dataset[name].dims != (name,):
            raise refused(name, "is no coordinate along the dimension of its name")
    unknown = np.setdiff1d(dataset["status"].values, [int(status) for status in Status])
    if unknown.size:
        raise refused("status", f"is {unknown[0]} in a cell, which is the code of none")


# ---- plain data, checked against annotations -----------------------------------------------------


def refused(path: str, why: str) -> DataError:
    """The error for a part that is not as rsfstudy writes it."""
    return DataError(
        f"{brief(path)} {why}. It was not written by this version of rsfstudy, or was edited: run "
        "the study again."
    )


def fit(value: Any, kind: Any, path: str) -> Any:
    """Convert plain data to the type that an annotation names: a mapping of all its fields to a
    dataclass, a list to a tuple.

    Parameters
    ----------
    value : object
        What JSON gives, or an object of a dataclass that exists already.
    kind : type
        A type, or another annotation of a field.
    path : str
        Where the value stands in its file.

    Raises
    ------
    DataError
        Where it cannot be converted; the text names the path.
    """
    origin, of = get_origin(kind), get_args(kind)
    if kind is Any or _is_one(value, kind):
        return value
    if kind is Scene and isinstance(value, dict):
        return scene(value, path=path)
    if (is_dataclass(kind) or is_typeddict(kind)) and isinstance(value, dict):
        return _object(value, kind, path)
    if origin is UnionType:
        return _either(value, of, path)
    if origin is Mapping and isinstance(value, dict):
        return {name: fit(part, of[1], f"{path}.{name}") for name, part in value.items()}
    if origin in (Sequence, tuple) and isinstance(value, list | tuple):
        return _list(value, origin, of, path)
    if kind is float and isinstance(value, int) and abs(value) < 2**1023:
        return value
    if kind is int and isinstance(value, float) and value.is_integer():
        return int(value)
    raise _unfit(value, (kind,), path)


_WORDS = {
    str: "a text",
    float: "a number",
    int: "a whole number",
    bool: "true or false",
    NoneType: "null",
    Sequence: "a list",
    tuple: "a list",
}


def _is_one(value: Any, kind: Any) -> bool:
    return isinstance(kind, type) and not is_typeddict(kind) and isinstance(value, kind)


def _unfit(value: Any, kinds: Sequence[Any], path: str) -> DataError:
    shown = value.tolist() if isinstance(value, np.generic | np.ndarray) else value
    wanted = " or ".join(_WORDS.get(get_origin(kind) or kind, "a mapping") for kind in kinds)
    return refused(path, f"is {brief(json.dumps(shown, default=repr))}, and must be {wanted}")


def _either(value: Any, kinds: Sequence[Any], path: str) -> Any:
    for kind in kinds:
        try:
            return fit(value, kind, path)
        except DataError:
            continue
    raise _unfit(value, kinds, path)


def _list(value: Sequence[Any], origin: Any, of: tuple[Any, ...], path: str) -> Any:
    kinds = of[:1] * len(value) if origin is Sequence or of[1:] == (...,) else of
    if len(value) != len(kinds):
        raise refused(path, f"has {len(value)} parts, and must have {len(kinds)}")
    parts = (fit(v, k, f"{path}[{i}]") for i, (v, k) in enumerate(zip(value, kinds, strict=True)))
    return tuple(parts) if origin is tuple else list(parts)


def _object(value: Mapping[str, Any], kind: Any, path: str) -> Any:
    """A dataclass has its fields and no others; a typed dictionary may have others."""
    kinds, closed = get_type_hints(kind), is_dataclass(kind)
    names = [field.name for field in fields(kind)] if is_dataclass(kind) else list(kinds)
    parts = _fitted(value, {name: kinds[name] for name in names}, path)
    if not closed:
        return {**value, **parts}
    for name in value:
        if name not in names:
            raise refused(_inside(path, name), "is unknown")
    try:
        return kind(**parts)
    except InvalidValue as error:
        raise refused(_inside(path, error.name), f"is refused ({error})") from error


def _fitted(value: Mapping[str, Any], kinds: Mapping[str, Any], path: str) -> dict[str, Any]:
    """The required parts of a mapping, each converted to its type."""
    for name in kinds:
        if name not in value:
            raise refused(_inside(path, name), "is missing")
    return {name: fit(value[name], kind, _inside(path, name)) for name, kind in kinds.items()}


def _inside(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name
