"""Fuzzer of the Python interface.

Usage: ``python tests/benchmarks/fuzz_python.py --seed 1 --count 2000``. The script makes valid
calls of every public function, constructor and method, in which it replaces one or two arguments
by junk. Each call should return a value or raise an error of rsfstudy. The script reports:

- raw: any other exception
- catch-all: an error of rsfstudy that only repeats a Python exception
- hang: a call that takes longer than 20 s
- died: a process that ends during a call
- control: a control character in a message, a warning or a representation

The seed and the number of a call determine the call. To repeat one call, pass
``--first N --count 1``.
"""

from __future__ import annotations

import argparse
import collections
import copy
import datetime
import faulthandler
import importlib
import inspect
import io
import json
import os
import queue
import random
import re
import subprocess
import sys
import tempfile
import threading
import traceback
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from scipy.stats import norm

import rsfstudy
from rsfstudy import Axis, Rig, Scene, Study, reductions
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.errors import RsfStudyError
from rsfstudy.responses.linear_stability import LinearStability

CALL_TIME_LIMIT = 20.0
START_TIME_LIMIT = 120.0
CATCH_ALL = re.compile(r"cannot be answered|not as rsfstudy made it|cannot be had of this dataset")
#: Parameters without junk, because a random value could start many processes.
PARAMETERS_WITHOUT_JUNK = ("workers",)
#: Module of the descriptors of former names, which refer to the members with the new names.
FORMER_NAMES = "rsfstudy._deprecation"


class HostileObject:
    """Object whose ``repr`` and comparison raise an exception."""

    def __repr__(self) -> str:
        raise RuntimeError("no repr")

    def __eq__(self, other: object) -> bool:
        raise RuntimeError("no eq")

    __hash__ = None  # type: ignore[assignment]


def junk_values() -> list[Any]:
    """Create a list of unusual values of many types.

    The values are new objects in each call, because the tested functions may change them.
    """
    numbers = [
        0, 1, -1, 3, 7.5, -0.0, 1e308, 5e-324, float("nan"), float("inf"), -float("inf"), 10**30,
        10**400, -(10**400), 2**63, 1j, True, False,
    ]  # fmt: skip
    texts = [
        "", " ", "other", "slip", "a" * 300, "a" * 100_000, "\0", "\udcff", "\x1b[31mred",
        "a\nb", "\x1b]0;x\x07", "5 MPa", "1:2:3", "nan", "../..", "é", "{}", "$x$", "%s", "{a}",
        "=", "rsf_study", "b_over_a", "status", "1e400", "\u202e",
    ]  # fmt: skip
    containers = [
        [], {}, (), set(), [[]], [None], [1, "a"], {"a": None}, {1: 2}, {"time": [1.0, 2.0]},
        ("a", 2), range(0), range(10**12), range(3), [[[[1]]]], {"a": {"b": {}}}, "ab",
        frozenset({1}), iter([1]), collections.deque([1]), (x for x in [1]), [float("nan")],
        [10**400], [-1.0, 1.0], {"b_over_a": [2.0]}, {"\x1b[0m": 1},
    ]  # fmt: skip
    arrays = [
        np.ones(2), np.ones((2, 2)), np.array(1.0), np.array([]), np.array("x", dtype=object),
        np.array([1, None], dtype=object), np.ma.masked_array([1.0, 2.0], [0, 1]), np.ma.masked,
        np.array(["a"]), np.array([1 + 1j]), np.float32(1.5), np.array([np.datetime64("2020")]),
        np.bool_(True), np.int8(3), np.datetime64("2020"), np.timedelta64(1, "s"),
        np.zeros(3, dtype=[("a", float)]), np.full(3, np.nan), np.longdouble(1),
    ]  # fmt: skip
    tables = [
        pd.DataFrame({"a": [1.0]}), pd.Series([1.0]), pd.DataFrame(), pd.NaT, pd.NA,
        xr.Dataset(), xr.DataArray([1.0]), xr.Dataset({"a": ("x", [1.0])}),
        xr.Dataset(attrs={"declaration": "{}"}), xr.Dataset(attrs={"scene": "{}"}),
        xr.Dataset(attrs={"scene": 5}), pd.Timestamp("2020"), pd.Timedelta("1s"),
    ]  # fmt: skip
    others = [
        None,
        Ellipsis,
        NotImplemented,
        object(),
        int,
        dict,
        Scene,
        ValueError,
        ValueError("x"),
        lambda: 1,
        lambda *a, **k: None,
        len,
        print,
        np,
        rsfstudy,
        HostileObject(),
        b"bytes",
        bytearray(2),
        memoryview(b"a"),
        io.StringIO("a"),
        Path("."),
        Path("a" * 5000),
        Path("missing.nc"),
        Path("/dev/null"),
        datetime.datetime(2020, 1, 1),
        datetime.timedelta(1),
        slice(1),
        re.compile("a"),
        Scene(),
        Axis("b_over_a", [2.0]),
        random.Random(1),
        type("T", (), {}),
    ]
    return [*numbers, *texts, *containers, *arrays, *tables, *others]


# ---- valid calls ---------------------------------------------------------------------------------


def record() -> Any:
    """Create a record of 60 rows with one velocity step."""
    time = np.arange(60.0)
    moved = np.where(time < 30.0, time, 30.0 + 10.0 * (time - 30.0))
    friction = 0.6 + np.where(time < 30.0, 0.0, 0.01 * np.exp(-(time - 30.0)))
    columns = {"time": time, "displacement": moved, "friction": friction}
    return rsfstudy.read_record({**columns, "normal_stress": np.full(60, 5.0)})


def valid_inputs(place: Path) -> dict[str, Any]:
    """Create scenes, studies, datasets, records and files for valid calls."""
    quick = {"rtol": 1e-2, "engine": "scipy"}
    scene = Scene(stiffness_ratio=1.5, load_velocity_ratio=2.0, normal_stress="constant")
    cycling = Scene(stiffness_ratio=0.8, normal_stress="constant")
    axes = [Axis("law", ["slip", "slowness"]), Axis("b_over_a", [1.5, 2.0, 3.0])]
    base, measure = Scene(normal_stress="constant"), LinearStability()
    study = Study(name="fuzzed", title="Fuzzed", base=base, axes=axes, measure=measure)
    rig = Rig(normal_stress="5 MPa", slip_distance="10 um", reference_velocity="1 um/s",
                     stiffness="1 MPa/um")  # fmt: skip
    dataset = rsfstudy.run(study, workers=0, progress=False, output=place)
    motion = rsfstudy.simulate(scene, duration=0.1, **quick)
    motion.to_netcdf(place / "motion.nc")
    (place / "protocol.csv").write_text("velocity (V_*), duration (D_c/V_*)\n2, 1\n")
    rows = zip(*record().columns.values(), strict=True)
    lines = ["time (s), displacement (um), friction, normal_stress (Pa)"]
    lines += [", ".join(map(repr, map(float, row))) for row in rows]
    (place / "record.csv").write_text("\n".join(lines))
    fitted = rsfstudy.fit(record(), stiffness=3e-3, laws=["slip"], free=["a", "mu_star"],
                          noise="white", slip_distance=10.0, budget=20_000)  # fmt: skip
    return {
        "scene": scene, "cycling": cycling, "study": study, "rig": rig, "dataset": dataset,
        "motion": motion, "record": record(), "fitted": fitted, "measure": measure, "axes": axes,
        "cycle": rsfstudy.limit_cycle(cycling, **quick), "file": place / "fuzzed.nc",
        "place": place,
    }  # fmt: skip


#: Arguments of valid reductions. Each reduction uses those in its signature.
REDUCTION_ARGUMENTS = {
    "name": "made", "of": "critical_stiffness", "on": "b_over_a", "over": "b_over_a",
    "along": "b_over_a", "reference": 2.0, "q": 0.5, "form": "velocity_step_at_critical_stiffness",
}  # fmt: skip
RIG_ARGUMENTS = {"normal_stress": "5 MPa", "slip_distance": "10 um", "reference_velocity": "1 um/s"}


def call_targets(known: dict[str, Any]) -> dict[str, tuple[Callable[..., Any], dict[str, Any]]]:
    """Return all public functions, constructors and methods.

    Each target has the arguments of a valid call. If there are no arguments for a required
    parameter, the fuzzer passes junk.
    """
    quick, place = {"rtol": 1e-2, "engine": "scipy"}, known["place"]
    still = {"workers": 0, "progress": False}
    dataset, scene, rig = known["dataset"], known["scene"], known["rig"]
    stated = {"time": [0.0, 1.0], "displacement": [0.0, 1.0]}
    fit = {"laws": ["slip"], "free": ["a", "mu_star"], "noise": "white", "slip_distance": 10.0,
           "stiffness": 3e-3, "budget": 20_000}  # fmt: skip
    valid: dict[str, dict[str, Any]] = {
        "recompute_cell": {"file": known["file"], "place": {"law": "slip", "b_over_a": 2.0}},
        "check": {"dataset": dataset},
        "compare": {"first": dataset, "second": dataset},
        "critical_step": {"scene": scene, **quick},
        "events": {"time": np.arange(400.0), "shear_stress": np.zeros(400)},
        "limit_cycle": {"scene": known["cycling"], **quick},
        "fit": {"record": known["record"], **fit},
        "read_record": {"source": place / "record.csv"},
        "open": {"name": known["file"]},
        "plot": {"dataset": dataset},
        "history": {"record": stated},
        "protocol": {"segments": [{"velocity": 2.0, "duration": 1.0}, {"velocity": 1.0}]},
        "read_table": {"path": place / "protocol.csv"},
        "read_protocol": {"path": place / "protocol.csv"},
        "report": {"directory": place},
        "rerun": {"file": known["file"], **still},
        "run": {"study": known["study"], "output": None, **still},
        "simulate": {"scene": scene, "duration": 0.1, **quick},
        "plot_motion": {"motion": known["motion"]},
        "to_si": {"dataset": dataset, "normal_stress": 5e6, "slip_distance": 1e-5},
        "Axis": {"dimension": "b_over_a", "values": [1.5, 2.0]},
        "Axis.samples": {"distribution": {"a": norm(0.01, 0.001)}, "n": 4},
        "Axis.cases": {"table": {"a": [0.01, 0.02]}},
        "Study": {"name": "s", "title": "S", "base": scene, "axes": known["axes"],
                  "measure": known["measure"]},
        "Study.caption": {"docstring": "One.\n\nTwo."},
        "Rig": dict(RIG_ARGUMENTS),
        "Claim": {"id": "C", "statement": "", "source": "", "variable": "v", "where": {},
                  "published": 1.0, "tolerance": 1.0, "reason": ""},
        "Panel": {"x": "b_over_a", "y": "critical_stiffness", "hue": ["law"]},
        "Figure": {"panels": [rsfstudy.Panel(x="b_over_a", y="critical_stiffness")]},
        "Scene": {"normal_stress": "constant", "b_over_a": 2.0},
        "Segment": {"load_velocity": 2.0, "duration": 1.0},
        "Accuracy": {"rtol": 1e-6},
    }  # fmt: skip
    methods: dict[str, dict[str, Any]] = {
        "Record.window": {"begins": 5.0, "ends": 50.0},
        "Record.with_steps": {"steps": [(30.0, 30.0, 1.0, 10.0)]},
        "Rig.axis": {"dimension": "slip_distance", "values": ["1 um", "2 um"]},
        "Rig.dimensionless": {"value": "10 s"},
        "Rig.scene": {"b_over_a": 2.0},
        "Rig.protocol": {"segments": [{"velocity": "2 um/s"}]},
        "Rig.in_units": {"dataset": known["motion"]},
        "Scene.with_": {"b_over_a": 3.0},
        "Scene.with_segment": {"segment": rsfstudy.Segment(1.0)},
        "Scene.segment_scene": {"number": 0},
        "Study.with_": {"b_over_a": [2.0]},
        "Axis.with_rows": {"rows": [{"b_over_a": 2.0}], "units": {}},
        "DatasetAccessor.to_si": {"normal_stress": 5e6, "slip_distance": 1e-5},
        "DatasetAccessor.slip_mode": {"stick_slip_from": "1 mm/s"},
        "DatasetAccessor.sample_parameters": {"n": 3},
    }
    found: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {}
    for name in rsfstudy.__all__:
        member = getattr(rsfstudy, name)
        found[name] = member, valid.get(name, {})
        if inspect.isclass(member):
            for inner in ("samples", "cases", "caption"):
                if hasattr(member, inner):
                    found[f"{name}.{inner}"] = getattr(member, inner), valid[f"{name}.{inner}"]
    for name in reductions.__all__:
        member = getattr(reductions, name)
        taken = inspect.signature(member).parameters
        found[f"reduce.{name}"] = (
            member,
            {n: v for n, v in REDUCTION_ARGUMENTS.items() if n in taken},
        )
    found["reduce.apply_reductions"] = (
        reductions.apply_reductions,
        {"dataset": dataset, "reductions": ()},
    )
    for module in ("critical_step", "elasticities", "healing", "limit_cycle", "linear_stability",
                   "rigid_response", "velocity_step"):  # fmt: skip
        for name, member in vars(importlib.import_module(f"rsfstudy.measures.{module}")).items():
            is_own = getattr(member, "__module__", "") == f"rsfstudy.measures.{module}"
            if inspect.isclass(member) and is_own and not name.startswith("_"):
                found[f"measures.{name}"] = member, {}
    objects = {
        "Record": known["record"], "Rig": rig, "Scene": scene, "Study": known["study"],
        "Axis": known["axes"][0], "Accessor": dataset.rsf,
        "Accessor of a motion": known["motion"].rsf,
        "Accessor of a fit": known["fitted"].rsf, "Accessor of a cycle": known["cycle"].rsf,
        "Protocol": rsfstudy.protocol([{"velocity": 2.0}]), "History": rsfstudy.history(stated),
        "Comparison": rsfstudy.compare(dataset, dataset), "Measure": known["measure"],
        "CriticalStep": CriticalStep(), "Segment": rsfstudy.Segment(1.0),
        "Reduction": reductions.LinearFit("made", of="critical_stiffness", on="b_over_a"),
        "Figure": rsfstudy.Figure([]), "Accuracy": rsfstudy.Accuracy(),
    }  # fmt: skip
    for title, thing in objects.items():
        for name in dir(type(thing)):
            if name.startswith(("_", "auxiliary_")) or not callable(
                getattr(type(thing), name, None)
            ):
                continue
            if inspect.getattr_static(type(thing), name).__class__.__module__ == FORMER_NAMES:
                continue
            method, entry = getattr(thing, name), f"{title.split()[0]}.{name}"
            if inspect.isroutine(method) and _is_ours(method):
                found[f"{title}.{name}"] = method, methods.get(entry, {})
    return found | composed_functions(known) | accessor_properties(known)


def composed_functions(
    known: dict[str, Any],
) -> dict[str, tuple[Callable[..., Any], dict[str, Any]]]:
    """Return functions that create an object and then use it.

    Examples are a study that is run, a figure that is drawn, and a dataset that is altered, written
    to a file and read.
    """
    dataset, study, place = known["dataset"], known["study"], known["place"]
    still: dict[str, Any] = {"workers": 0, "progress": False, "output": None}
    parts = ("name", "title", "base", "axes", "measure")
    declared = {name: getattr(study, name) for name in parts}

    def reduction_on_results(kind: str, **options: Any) -> Any:
        made = {name: getattr(reductions, name) for name in reductions.__all__}[kind](**options)
        return (
            reductions.apply_reductions(dataset, (made,)),
            made(dataset),
            made.quantities,
            made.describe(),
        )

    def study_with(**options: Any) -> Any:
        return rsfstudy.run(Study(**{**declared, **options}), **still)

    def drawn(**options: Any) -> Any:
        figure = rsfstudy.Figure([rsfstudy.Panel(**options)])
        return rsfstudy.plot(dataset, user_figure=figure)

    def measured(kind: Any, scene: Any, accuracy: Any, options: Any) -> Any:
        return kind(**options)(scene, accuracy)

    def asked(of: xr.Dataset) -> Any:
        if not isinstance(of, xr.Dataset):
            return None
        answers = [of.rsf.failures, of.rsf.check, of.rsf.to_dataframe, of.rsf._repr_html_]
        number = len(str(of.attrs)) % len(answers)
        return answers[number]()

    def through_a_file(of: Any, use: Callable[[Path], Any]) -> Any:
        path = place / "altered" / "altered.nc"
        path.parent.mkdir(exist_ok=True)
        path.unlink(missing_ok=True)
        try:
            of.to_netcdf(path)
        except Exception:  # xarray or netCDF4 cannot write the dataset.
            return None
        return use(path)

    def rig_study(**options: Any) -> Any:
        rig = Rig(**{**RIG_ARGUMENTS, **options})
        axis = rig.axis("slip_distance", ["10 um", "20 um"])
        made = {**declared, "base": rig.scene(), "axes": [axis], "rig": rig}
        return rsfstudy.run(Study(**made), **still).rsf.in_units()

    def moved(**options: Any) -> Any:
        return rsfstudy.simulate(Scene(**options), duration=0.1, rtol=1e-2)

    def loaded(segments: Any) -> Any:
        return moved(loading=rsfstudy.protocol(segments), normal_stress="imposed")

    def recorded(**options: Any) -> Any:
        columns = {**known["record"].columns, **options}
        return rsfstudy.read_record(columns).steps()

    named = {"b_over_a": [2.0], "law": ["slip"], "stiffness_ratio": 1.1}
    quick = {"kind": CriticalStep, "scene": known["scene"], "accuracy": rsfstudy.Accuracy(1e-2)}
    found: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
        "study_with": (study_with, {**declared, "reductions": [], "claims": [], "plot": "lines",
                                    "references": [], "accuracy": rsfstudy.Accuracy(1e-2),
                                    "rig": None, "summary": ""}),
        "drawn": (drawn, {"x": "b_over_a", "y": "critical_stiffness", "hue": ["law"], "facet": [],
                          "isel": {}, "style": {}, "error_bars": "", "annotation": "",
                          "overlays": [],
                          "title": "t", "x_label": "x", "y_label": "y", "log": "", "fit_line": None,
                          "x_limits": (None, None), "y_limits": (0.0, 1.0), "y_scale_group": "",
                          "curve_label": None, "legend_columns": 2, "legend_title": None,
                          "condition": None}),
        "measured": (measured, {**quick, "options": {"of": "load_velocity_ratio"}}),
        "asked": (asked, {"of": dataset}),
        "asked of a motion": (asked, {"of": known["motion"]}),
        "asked of a fit": (asked, {"of": known["fitted"]}),
        "rig_study": (rig_study, {**RIG_ARGUMENTS}),
        "moved": (moved, {"law": "slip", "normal_stress": "constant", "load_velocity_ratio": 2.0,
                          "b_over_a": 2.0, "stiffness_ratio": 1.5, "inertia": False}),
        "loaded": (loaded, {"segments": [{"velocity": 2.0, "duration": 1.0}, {"velocity": 1.0}]}),
        "recorded": (recorded, dict(known["record"].columns)),
        "with other values": (rsfstudy.studies()["linear_stability"].with_, named),
    }  # fmt: skip
    uses: dict[str, Callable[[Path], Any]] = {
        "open": rsfstudy.open,
        "plot": rsfstudy.plot,
        "check": rsfstudy.check,
        "rerun": lambda path: rsfstudy.rerun(path, workers=0, progress=False),
        "report": lambda path: rsfstudy.report(path.parent),
        "show": lambda path: rsfstudy.open(path).rsf._repr_html_(),
    }
    for name, use in uses.items():
        found[f"{name} a file"] = (lambda of, use=use: through_a_file(of, use)), {"of": dataset}
    for kind in reductions.__all__:
        if kind not in ("Reduction", "apply_reductions"):
            taken = inspect.signature(getattr(reductions, kind)).parameters
            options = {n: v for n, v in REDUCTION_ARGUMENTS.items() if n in taken}
            found[f"reduced by {kind}"] = reduction_on_results, {"kind": kind, **options}
    return found


def accessor_properties(
    known: dict[str, Any],
) -> dict[str, tuple[Callable[..., Any], dict[str, Any]]]:
    """Return functions that read the properties of the dataset accessor."""
    found: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {}
    for of in ("dataset", "motion", "fitted", "cycle"):
        for name in ("scene", "rig", "study"):
            found[f"{of}.rsf.{name}"] = (
                lambda of, name=name: isinstance(of, xr.Dataset) and getattr(of.rsf, name),
                {"of": known[of]},
            )
    return found


def _is_ours(method: Any) -> bool:
    return str(getattr(method, "__module__", "")).startswith("rsfstudy")


# ---- mutations -----------------------------------------------------------------------------------


def mutate_value(value: Any, draw: random.Random) -> Any:
    """Return junk, or a copy of a value with junk in one place."""
    if draw.random() < 0.35:
        if isinstance(value, dict) and value:
            key = draw.choice(list(value))
            return {**value, key: mutate_value(value[key], draw)}
        if isinstance(value, list | tuple) and value:
            at = draw.randrange(len(value))
            made = [mutate_value(v, draw) if n == at else v for n, v in enumerate(value)]
            return type(value)(made) if type(value) in (list, tuple) else tuple(made)
        if isinstance(value, np.ndarray) and value.ndim == 1 and len(value):
            made = value.astype(object)
            made[draw.randrange(len(value))] = draw.choice([None, "a", np.nan, np.inf, 10**400])
            return made
        if isinstance(value, xr.Dataset):
            return alter_dataset(value, draw)
        if isinstance(value, str | Path) and draw.random() < 0.5:
            return str(value) + draw.choice(["\0", "x", " ", "\x1b[31m", "/..", "\udcff"])
    return draw.choice(junk_values())


def alter_dataset(dataset: xr.Dataset, draw: random.Random) -> xr.Dataset:
    """Change a dataset as a user may change it in a notebook."""
    names = [str(name) for name in dataset.variables]
    dims = [str(name) for name in dataset.dims]
    if not names or not dataset.attrs:
        return dataset
    way = draw.choice([0, 1, 2, 2, 3, 4, 4, 4, 5, 6, 7])
    if way == 0:
        return dataset.drop_vars(draw.choice(names))
    if way == 1 and dims:
        return dataset.isel({draw.choice(dims): draw.choice([0, slice(0)])})
    if way == 2:
        key = draw.choice(list(dataset.attrs))
        return dataset.assign_attrs({key: draw.choice(junk_values())})
    if way == 3:
        return dataset.drop_attrs()
    if way == 4:
        made, name = dataset.copy(), draw.choice(names)
        attribute = draw.choice(["units", "long_name", "flag_values", "flag_meanings", "scale"])
        made[name].attrs[attribute] = draw.choice(junk_values())
        return made
    if way == 5:
        # The library xarray rejects another shape for a coordinate of a dimension.
        name = draw.choice([name for name in names if name not in dims] or ["x"])
        return dataset.assign({name: draw.choice([5.0, ("q", [1.0])])})
    if way == 6:
        return dataset.astype(draw.choice([str, object]))
    attributes = {key: text for key, text in dataset.attrs.items() if draw.random() < 0.7}
    made = dataset.copy()
    made.attrs = attributes
    return made


def call_of(
    function: Callable[..., Any], valid: dict[str, Any], draw: random.Random
) -> tuple[tuple[Any, ...], dict[str, Any]]:
    """Return the arguments of a valid call with one or two invalid changes."""
    parameters = inspect.signature(function).parameters
    plain = [n for n, p in parameters.items() if p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
    plain = [n for n in plain if n not in PARAMETERS_WITHOUT_JUNK and n != "self"]
    options = dict(valid)
    for name in plain:
        if parameters[name].default is inspect.Parameter.empty and name not in options:
            options[name] = draw.choice(junk_values())
    plain += [n for n in options if n not in plain and n not in PARAMETERS_WITHOUT_JUNK]
    for _ in range(1 if draw.random() < 0.85 else 2):
        way = draw.random()
        if way < 0.8 and plain:
            name = draw.choice(plain)
            options[name] = mutate_value(options.get(name), draw)
        elif way < 0.9:
            name = draw.choice([*plain, "x", "b_over_a", "units"])
            options[draw.choice([name[:-1] or "y", f"{name}s", "\x1b[31m", "self"])] = 1
        elif way < 0.95:
            return (*options.values(), *(draw.choice(junk_values()),) * draw.randrange(2)), {}
        elif left := [name for name in options if name not in PARAMETERS_WITHOUT_JUNK]:
            del options[draw.choice(left)]
    return (), options


# ---- outcomes ------------------------------------------------------------------------------------


def is_clean(text: str) -> bool:
    """Return True if a string contains no control characters.

    Newlines and tabs are allowed.
    """
    return all(c.isprintable() or c in "\n\t" for c in text)


def shown(answer: Any) -> Iterator[str]:
    """Yield the text and HTML representations of an object of rsfstudy."""
    if not type(answer).__module__.startswith("rsfstudy"):
        return
    yield repr(answer)
    if hasattr(answer, "_repr_html_"):
        yield answer._repr_html_() or ""


def outcome(function: Callable[..., Any], args: Any, options: Any) -> tuple[str, str]:
    """Call a function, and return the kind and message of the outcome."""
    texts: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            answer = function(*args, **options)
            kind, told = "answer", ""
        except RsfStudyError as error:
            told = str(error)
            kind = "catch-all" if CATCH_ALL.search(told) else "refused"
            texts.append(told)
        except BaseException as error:
            frames = traceback.extract_tb(error.__traceback__)
            if not _is_ours(function) and all(f.filename == __file__ for f in frames):
                return "answer", "the fuzzer itself cannot use the junk"
            where = frames[-1]
            told = f"{type(error).__name__}: {str(error)[:300]} ({where.filename}:{where.lineno})"
            return "raw", told
        if kind == "answer":
            try:
                texts += shown(answer)
            except BaseException as error:
                return "raw", f"shown: {type(error).__name__}: {str(error)[:300]}"
    texts += [str(w.message) for w in caught if w.category.__module__.startswith("rsfstudy")]
    bad = [text for text in texts if not is_clean(text)]
    return ("control", bad[0][:500]) if bad else (kind, told)


def text_of(value: Any) -> str:
    """Return the representation of a value, or its type name."""
    try:
        return repr(value)[:200]
    except Exception:
        return f"<{type(value).__name__}>"


def make_calls(seed: int, first: int, count: int, step: int) -> None:
    """Make the selected calls.

    The function prints a line of JSON before and after each call.
    """
    lines = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    top = Path(tempfile.mkdtemp())
    place = top / "1" / "2" / "3" / "4"
    place.mkdir(parents=True)
    os.chdir(place)
    (place / "kept").mkdir()
    warnings.simplefilter("ignore")
    known = valid_inputs(place / "kept")
    every = call_targets(known)
    names = sorted(every)
    for number in range(first, count, step):
        draw = random.Random(f"{seed} {number}")
        function, valid = every[draw.choice(names)]
        name = next(n for n, (f, _v) in every.items() if f is function)
        args, options = call_of(function, copy.copy(valid), draw)
        given = ", ".join([*map(text_of, args), *(f"{n}={text_of(v)}" for n, v in options.items())])
        print(json.dumps({"number": number, "call": f"{name}({given})"}), file=lines, flush=True)
        faulthandler.dump_traceback_later(CALL_TIME_LIMIT - 2.0)
        kind, told = outcome(function, args, options)
        faulthandler.cancel_dump_traceback_later()
        print(json.dumps({"number": number, "kind": kind, "text": told}), file=lines, flush=True)


def supervise_calls(seed: int, first: int, count: int, step: int, found: queue.Queue[Any]) -> None:
    """Run the calls in a subprocess.

    A new subprocess is started after a hang or a crash.
    """
    number = first
    while number < count:
        words = [sys.executable, __file__, "--seed", str(seed), "--first", str(number)]
        words += ["--count", str(count), "--work", str(step)]
        with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            lines: queue.Queue[str] = queue.Queue()
            reading = threading.Thread(
                target=lambda p=process, q=lines: [*map(q.put, p.stdout), q.put("")]
            )
            reading.start()
            pending, limit = "", START_TIME_LIMIT
            while True:
                try:
                    line = lines.get(timeout=limit)
                except queue.Empty:
                    process.kill()
                    found.put((number, "hang", pending, ""))
                    break
                if not line:
                    if number < count and pending:
                        found.put((number, "died", pending, ""))
                    elif number < count:
                        found.put((number, "died", "before the first call", ""))
                        number = count
                    break
                told = json.loads(line)
                number = told["number"]
                if "call" in told:
                    pending, limit = told["call"], CALL_TIME_LIMIT
                    continue
                found.put((number, told["kind"], pending, told["text"]))
                pending, limit, number = "", CALL_TIME_LIMIT, number + step
            if pending:
                number += step
    found.put(None)


def main() -> int:
    """Make the calls in subprocesses, and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--first", type=int, default=0, help="number of the first call")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--all", action="store_true", help="print every call")
    parser.add_argument("--work", type=int, default=0, help=argparse.SUPPRESS)
    given = parser.parse_args()
    count = given.count if given.work else given.first + given.count
    if given.work:
        make_calls(given.seed, given.first, count, given.work)
        return 0
    found: queue.Queue[Any] = queue.Queue()
    each = min(given.processes, given.count)
    for n in range(each):
        args = (given.seed, given.first + n, count, each, found)
        threading.Thread(target=supervise_calls, args=args).start()
    kinds: collections.Counter[str] = collections.Counter()
    while each:
        one = found.get()
        if one is None:
            each -= 1
            continue
        number, kind, call, told = one
        kinds[kind] += 1
        if given.all or kind not in ("answer", "refused"):
            print(f"{kind} {number}: {call[:600]!r}\n    {told[:600]!r}", flush=True)
    print(dict(kinds))
    return int(bool(set(kinds) - {"answer", "refused"}))


if __name__ == "__main__":
    sys.exit(main())
