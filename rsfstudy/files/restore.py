"""A study from the declaration that its results carry: plain data in, and no code of the file's is
run.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator, Sequence
from dataclasses import fields
from types import ModuleType
from typing import Any, TypedDict

from rsfstudy import measures, reduce
from rsfstudy.declare.axis import Axis
from rsfstudy.declare.study import Study
from rsfstudy.errors import InvalidValue
from rsfstudy.files.contents import Declaration, PlainMeasure, PlainReduction, fit, refused
from rsfstudy.measures import Measure
from rsfstudy.measures._problem import Problem
from rsfstudy.reduce import Reduction
from rsfstudy.status import Status


def study(declared: Declaration, of_its_own: Study | None = None) -> Study:
    """The study that describes itself by this declaration.

    Parameters
    ----------
    declared : Declaration
    of_its_own : Study, optional
        Where to take the measure and the reductions from, if they are not part of rsfstudy; the
        measure with the plain fields that the declaration states.

    Raises
    ------
    InvalidValue
        Where its measure or a reduction is not part of rsfstudy.
    DataError
        Where the declaration makes no study, naming the part.
    """
    parts = {field.name: getattr(declared, field.name) for field in fields(declared)}
    if of_its_own is None:
        parts["measure"] = measure(declared.measure, "declaration.measure")
        parts["reductions"] = [
            _reduction(described, f"declaration.reductions[{number}]")
            for number, described in enumerate(declared.reductions)
        ]
    else:
        for name in ("measure", "reductions", "declared_in"):
            parts[name] = getattr(of_its_own, name)
        own = of_its_own.measure
        stated = {name: v for name, v in declared.measure.items() if name in own.plain_fields}
        parts["measure"] = own.with_(**stated)
    try:
        parts["axes"] = [Axis(axis["dimension"], axis["values"]) for axis in declared.axes]
        return Study(**parts)
    except InvalidValue as error:
        raise refused("declaration", f"makes no study ({error})") from error


def measure(described: PlainMeasure, path: str) -> Measure:
    """The measure that describes itself so, at a path in a file."""
    values: dict[str, Any] = dict(described)
    name, kinds = values.pop("name"), _kinds(Measure, measures)
    if name not in kinds:
        raise InvalidValue("measure", name, "is not part of rsfstudy", choices=kinds)
    if "problems" in values:
        values["problems"] = _problems(values["problems"], f"{path}.problems")
    found: Measure = fit(values, kinds[name], path)
    return found


class _PlainProblem(TypedDict):
    """A problem; what else it holds is numbers and texts."""

    measure: PlainMeasure
    status: str
    scale: float | None


def _problems(described: Any, path: str) -> list[Problem]:
    plain: Sequence[_PlainProblem] = fit(described, Sequence[_PlainProblem], path)
    return [_problem(problem, f"{path}[{number}]") for number, problem in enumerate(plain)]


def _problem(described: _PlainProblem, path: str) -> Problem:
    statuses = {status.label: status for status in Status}
    if described["status"] not in statuses:
        raise refused(f"{path}.status", "is unknown")
    made = {
        "measure": measure(described["measure"], f"{path}.measure"),
        "status": statuses[described["status"]],
        "scale": described["scale"] or 0.0,
    }
    found: Problem = fit({**described, **made}, Problem, path)
    return found


def _reduction(described: PlainReduction, path: str) -> Reduction:
    values: dict[str, Any] = dict(described)
    wanted, kinds = values.pop("kind"), _kinds(Reduction, reduce)
    if wanted not in kinds:
        raise InvalidValue("reduction", wanted, "is not part of rsfstudy", choices=kinds)
    found: Reduction = fit(values, kinds[wanted], path)
    return found


def _kinds(base: Any, package: ModuleType) -> dict[str, Any]:
    """The classes of a package that are derived from one, by what they call themselves."""
    for module in pkgutil.iter_modules(package.__path__):
        importlib.import_module(f"{package.__name__}.{module.name}")
    within = f"{package.__name__}."
    return {
        vars(kind).get("name") or vars(kind)["kind"]: kind
        for kind in _members(base)
        if kind.__module__.startswith(within)
    }


def _members(base: Any) -> Iterator[Any]:
    """Classes derived from one, that are not for others to derive from."""
    for kind in base.__subclasses__():
        yield from _members(kind)
        if "name" in vars(kind) or "kind" in vars(kind):
            yield kind
