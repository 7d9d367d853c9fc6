"""Tests of the error messages of invalid input.

Each field is tested against the rule in its declaration. The file ``wordings.txt`` contains
messages that a person should read, each below the call or command that causes it. Run
``python tests/test_wordings.py`` to update the file, and read the differences.
"""

from __future__ import annotations

import contextlib
import functools
import math
import os
import re
import shlex
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy.stats import norm
from study_runs import call_main

import rsfstudy
from rsfstudy import Axis, Rig, Scene
from rsfstudy.cli import rig_options
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.errors import InvalidValue
from rsfstudy.measure_base.elasticities import Elasticities
from rsfstudy.measures import Measure
from rsfstudy.motion import engines
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.quantities import Output
from rsfstudy.reductions import Reduction
from rsfstudy.rig.units import convert_to_si
from rsfstudy.slider.part_registry import PART_CLASS_BY_FIELD_NAME, PART_SLOTS
from rsfstudy.slider.parts import CONDITION_BY_VALUE_RULE, is_boolean_field, list_part_field_names
from rsfstudy.slider.slider_parameters import SliderParameters
from rsfstudy.study import study_loader
from rsfstudy.study.claims import Claim
from rsfstudy.study.named_study_index import list_study_names

WORDINGS = Path(__file__).with_name("wordings.txt")


# ---- each field by its declaration ---------------------------------------------------------------
#: Numbers that violate each rule.
BREAKING = {
    "": (),
    "must be greater than 0": (0.0, -1.0),
    "must be 0 or greater": (-1.0,),
    "must be a whole number from 0 to 100,000": (-1.0, 1.5, 1e6),
    "must be a whole number from 1 to 100,000": (0.0, 1.5, 1e6),
    "must be greater than -1": (-1.0,),
    "must be -1 or greater": (-1.5,),
    "must lie between 0 and 1": (-0.1, 1.1),
}
#: Values that are not numbers.
NO_NUMBERS = {"0.01": "must be a number", True: "must be a number", math.nan: "must be finite",
              math.inf: "must be finite"}  # fmt: skip


def calling(part: type) -> dict[str, Any]:
    """Return the fields that select a part."""
    if part is SliderParameters:
        return {}
    if field_name := part.field_name_that_selects_part:
        return {field_name: True if is_boolean_field(part, field_name) else 1.0}
    slot = next(slot for slot in PART_SLOTS if part in slot.built_in_parts.values())
    return (
        {slot.name: part.name}
        if not slot.part_class_by_selecting_field and part.name != slot.default_part_name
        else {}
    )


def broken() -> Iterator[tuple[dict[str, Any], str, str]]:
    """Yield scenes with a single invalid value, the field, and the rule."""
    for name, part in PART_CLASS_BY_FIELD_NAME.items():
        wrong = {"yes": "must be true or false"}
        if not is_boolean_field(part, name):
            rule = part.__dataclass_fields__[name].metadata["rule"]
            wrong = NO_NUMBERS | dict.fromkeys(BREAKING[rule], rule)
        for value, rule in wrong.items():
            yield {**calling(part), name: value}, name, rule


def test_every_rule_is_broken_here():
    assert set(BREAKING) == set(CONDITION_BY_VALUE_RULE)


@pytest.mark.parametrize(("fields", "name", "rule"), list(broken()), ids=str)
def test_each_field_is_held_to_its_rule(fields, name, rule):
    with pytest.raises(InvalidValue) as refused:
        Scene(**fields)
    value = fields[name]
    shown = repr(float(value)) if type(value) is float else repr(value)
    subject = name if "_" in name else repr(name)
    assert str(refused.value).startswith(f"{subject} {rule} (got {shown}).")


def foreign() -> Iterator[tuple[dict[str, Any], str]]:
    """Yield fields of a part together with another part of the same slot."""
    for slot in PART_SLOTS:
        for part in slot.built_in_parts.values():
            for other in slot.built_in_parts.values():
                calls = calling(other)
                for name in sorted(
                    {*list_part_field_names(part)}
                    - {*list_part_field_names(other), part.field_name_that_selects_part}
                ):
                    if PART_CLASS_BY_FIELD_NAME[name] is part:
                        yield {**calls, name: 0.5}, name


@pytest.mark.parametrize(("fields", "name"), list(foreign()), ids=str)
def test_no_field_is_taken_for_nothing(fields, name):
    with pytest.raises(
        InvalidValue, match=rf"^{name} = 0.5 (does not apply|cannot be set for law)"
    ):
        Scene(**fields)


def test_rig_options_are_described_as_the_quantities_of_a_rig():
    meanings = {name: quantity.description for name, quantity in Rig.QUANTITIES.items()}
    assert (
        meanings | {"load_velocity": "load point velocity"} == rig_options.MEANINGS_OF_RIG_OPTIONS
    )
    assert [*rig_options.MEANINGS_OF_RIG_OPTIONS] == [*rig_options.EXAMPLE_VALUES_OF_RIG_OPTIONS]


# ---- wordings ------------------------------------------------------------------------------------
def study(*axes, **fields) -> rsfstudy.Study:
    parts = {"base": Scene(), "axes": axes, "measure": CriticalStep()}
    return rsfstudy.Study(**{"name": "trial", "title": "Trial", **parts, **fields})


def csv(text: str) -> str:
    """Write a record to the working directory, and return its file name."""
    Path("record.csv").write_text(text, encoding="utf-8")
    return "record.csv"


def claim(**fields) -> Claim:
    parts = {"id": "C1", "statement": "", "source": "", "variable": "v", "where": {}}
    return Claim(**{**parts, "published": 1.0, "tolerance": 0.1, "reason": "", **fields})


def fitted(**options) -> xr.Dataset:
    """Return a fit of 40 rows around one step."""
    time = np.arange(40.0)
    moved = np.where(time < 20.0, time, 10.0 * time - 180.0)
    friction = 0.6 + np.where(time < 20.0, 0.0, 0.01 * np.exp(20.0 - time))
    record = rsfstudy.read_record({"time": time, "displacement": moved, "friction": friction})
    return rsfstudy.fit(record, **{"stiffness": 3e-3, "laws": ["slip"]} | options)


def own(**declared) -> Measure:
    """Return a user-defined measure with other declarations."""
    usual = {
        "name": "own",
        "primary_output": "total",
        "variables": {"total": ()},
        "typical_rhs_evaluations": 1,
    }
    return type("Own", (Measure,), usual | declared)()


def measuring(**declared) -> rsfstudy.Study:
    """Return a study of a user-defined measure."""
    return study(Axis("b_over_a", [2.0]), measure=own(**declared))


def members(base: type) -> Iterator[type]:
    yield base
    for kind in base.__subclasses__():
        yield from members(kind)


RIG = Rig(normal_stress="5 MPa", slip_distance="10 um", reference_velocity="1 um/s")


@functools.cache
def known() -> dict[str, Any]:
    """Return the names that the calls may use.

    The names are the public names, all measures and reductions, and some helper functions.
    """
    for name in list_study_names():
        study_loader.load_study(name)
    kinds = [*members(Measure), *members(Reduction)]
    return (
        {name: getattr(rsfstudy, name) for name in rsfstudy.__all__}
        | {kind.__name__: kind for kind in kinds if kind.__module__.startswith("rsfstudy.")}
        | {"inf": math.inf, "nan": math.nan, "np": np, "pd": pd, "norm": norm, "xr": xr}
        | {"Accuracy": Accuracy, "Output": Output}
        | {
            "study": study,
            "claim": claim,
            "csv": csv,
            "fitted": fitted,
            "RIG": RIG,
            "in_si": convert_to_si,
        }
        | {"own": own, "measuring": measuring, "Elasticities": Elasticities}
        | {"SimpleNamespace": SimpleNamespace}
        | {"lattice": lambda **options: rsfstudy.run(study(Axis("b_over_a", [2.0])), **options)}
    )


def answered(asked: str) -> str:
    """Return the error message of a call or command.

    The error must be raised before any file is written.
    """
    with contextlib.ExitStack() as stack:
        for slot in PART_SLOTS:  # Other tests register user-defined parts.
            stack.enter_context(mock.patch.dict(slot.user_parts, clear=True))
        if asked.startswith("rsfstudy "):
            ended = call_main(*shlex.split(asked)[1:])
            assert ended.returncode == 2
            return re.sub("^.*?rror: ", "", " ".join(ended.stderr.split()))
        refused = stack.enter_context(pytest.raises(InvalidValue))
        eval(asked, known())
    return str(refused.value)


def kept() -> dict[str, str]:
    """Return the expected messages by call."""
    blocks = WORDINGS.read_text(encoding="utf-8").strip().split("\n\n")
    parts = (block.partition("\n    ") for block in blocks if not block.startswith("#"))
    return {asked: message for asked, _between, message in parts}


@pytest.mark.parametrize(("asked", "message"), kept().items())
def test_a_message_is_worded_as_it_was_read(asked, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # Other tests register user-defined steppers.
    monkeypatch.setattr(engines, "_USER_STEPPER_CLASS_BY_NAME", {})
    assert answered(asked) == message
    assert set(os.listdir(tmp_path)) <= {"record.csv"}


if __name__ == "__main__":
    head, *blocks = WORDINGS.read_text(encoding="utf-8").strip().split("\n\n")
    asked = [block.split("\n")[0] for block in blocks]
    with tempfile.TemporaryDirectory() as place, contextlib.chdir(place):
        texts = [
            line if line.startswith("#") else f"{line}\n    {answered(line)}" for line in asked
        ]
    WORDINGS.write_text("\n\n".join([head, *texts]) + "\n", encoding="utf-8")
