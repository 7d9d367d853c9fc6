"""A study from the declaration that its results carry: plain data in, and no code of the file's is
run.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator, Mapping
from typing import Any

from rsfstudy import measures, reduce
from rsfstudy.axis import Axis
from rsfstudy.claims import Claim
from rsfstudy.core.accuracy import Accuracy
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.measures import Measure
from rsfstudy.measures.problem import Problem
from rsfstudy.reduce import Reduction
from rsfstudy.scene import Scene
from rsfstudy.status import Status
from rsfstudy.study import Study


def study(declaration: Mapping[str, Any], of_its_own: Study | None = None) -> Study:
    """The study that describes itself by this declaration.

    Parameters
    ----------
    declaration : mapping
    of_its_own : Study, optional
        Where to take the measure and the reductions from, if they are not part of rsfstudy; the
        measure with the plain fields that the declaration states.

    Raises
    ------
    InvalidValue
        Where its measure or a reduction is not part of rsfstudy.
    DataError
        Where the declaration is damaged.
    """
    parts = dict(declaration)
    try:
        described = parts.pop("measure"), parts.pop("reductions")
        if of_its_own is None:
            found, reductions = measure(described[0]), [_reduction(kind) for kind in described[1]]
        else:
            own = of_its_own.measure
            stated = {name: described[0][name] for name in own.plain_fields if name in described[0]}
            found, reductions = own.with_(**stated), list(of_its_own.reductions)
        return Study(
            base=Scene(**parts.pop("base")),
            axes=[Axis(axis["dimension"], axis["values"]) for axis in parts.pop("axes")],
            measure=found,
            accuracy=accuracy(parts.pop("accuracy")),
            reductions=reductions,
            claims=[Claim(**claim) for claim in parts.pop("claims")],
            **parts,
            declared_in="" if of_its_own is None else of_its_own.declared_in,
        )
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        if isinstance(error, InvalidValue) and error.name in ("measure", "reduction"):
            raise
        raise DataError(f"the study declaration is damaged: {error}") from error


def accuracy(described: Mapping[str, Any]) -> Accuracy:
    """The accuracy that describes itself so."""
    values = dict(described)
    methods = tuple((regime, name) for regime, name in values.pop("methods"))
    return Accuracy(**values, methods=methods)


def measure(described: Mapping[str, Any]) -> Measure:
    """The measure that describes itself so."""
    values = dict(described)
    name = values.pop("name")
    if name not in _measures():
        raise InvalidValue("measure", name, "is not part of rsfstudy", choices=_measures())
    module = importlib.import_module(f"{measures.__name__}.{name}")
    kind = next(m for m in _members(Measure) if m.__module__ == module.__name__ and m.name == name)
    if "problems" in values:
        values["problems"] = [_problem(problem) for problem in values["problems"]]
    found: Measure = kind(**_tuples(values))
    return found


def _measures() -> list[str]:
    return sorted(m.name for m in pkgutil.iter_modules(measures.__path__))


def _problem(described: Mapping[str, Any]) -> Problem:
    values = dict(described)
    return Problem(
        scene=Scene(**values.pop("scene")),
        measure=measure(values.pop("measure")),
        status=Status[values.pop("status").upper()],
        scale=values.pop("scale") or 0.0,
        **values,
    )


def _reduction(described: Mapping[str, Any]) -> Reduction:
    values = dict(described)
    wanted = values.pop("kind")
    kinds: dict[str, type[Reduction]] = {
        k.kind: k for k in _members(Reduction) if k.__module__.startswith(reduce.__name__)
    }
    if wanted not in kinds:
        raise InvalidValue("reduction", wanted, "is not part of rsfstudy", choices=kinds)
    return kinds[wanted](**_tuples(values))


def _members(base: Any) -> Iterator[Any]:
    """Classes derived from one, that are not for others to derive from."""
    for kind in base.__subclasses__():
        yield from _members(kind)
        if "name" in vars(kind) or "kind" in vars(kind):
            yield kind


def _tuples(values: Mapping[str, Any]) -> dict[str, Any]:
    """Lists as the tuples they were before they were written as JSON."""
    return {name: tuple(v) if isinstance(v, list) else v for name, v in values.items()}
