"""Ends of limit cycles between cells, and those that eigenvalues of steady sliding tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.quantity import Quantity
from rsfstudy.reduce.base import Reduction, dimension_of, failed, refused
from rsfstudy.slider.registry import FIELDS, KINDS, SLOT_NAMES, without_meaning
from rsfstudy.slider.scene import Scene
from rsfstudy.slider.stability import critical_stiffness
from rsfstudy.status import Status

_STIFFNESS = "stiffness_ratio"


@dataclass(frozen=True)
class CyclingEdge(Reduction):
    """Stiffness between cells with a limit cycle and cells that settle to steady sliding, beside
    the critical stiffness at V_0 that follows from the eigenvalues of steady sliding, with mass.

    Nothing is interpolated: the cells bracket the edge, and no more. Both are over k_cr(V_*).

    Parameters
    ----------
    name : str
        Name of the edge, the middle of its bracket; ``<name>_error`` (half its width),
        ``<name>_stable`` and ``<name>_unstable`` (its ends), ``<name>_crossings`` (how often the
        answer changes along stiffness: the edge is a number only where it changes once),
        ``<name>_linear`` (what the eigenvalues say), ``<name>_farthest`` (the largest distance of
        the two along `across`, over the width of the bracket) and ``<name>_misplaced`` (how many
        cells cycle above or settle below what the eigenvalues say) come with it.
    of : str
        Variable that is a number where there is a limit cycle.
    across : str
        Coordinate along the edge, of which the last two are summaries.
    """

    across: str = "load_velocity_ratio"
    kind: ClassVar[str] = "cycling_edge"

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Its results, as far as their names do not say what they are."""
        name, ratio = self.name, r"$k/k_{cr}(V_*)$"
        return (
            Quantity(name, ratio, "1", "stiffness at which limit cycles end, over k_cr(V_star)"),
            Quantity(
                f"{name}_linear",
                r"$k_{cr}(V_0)/k_{cr}(V_*)$",
                "1",
                "critical stiffness at V_0 by eigenvalues of steady sliding, over k_cr(V_star)",
            ),
            Quantity(
                f"{name}_farthest",
                "",
                "1",
                "largest distance of that edge from the linear boundary, over the spacing of cells",
            ),
            Quantity(
                f"{name}_misplaced",
                "",
                "1",
                "number of cells that cycle above the linear boundary or settle below it",
            ),
        )

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Bracket the edge along stiffness; nothing where parts of the slider are the user's own.

        Raises
        ------
        InvalidValue
            Where stiffness_ratio is no coordinate along one dimension.
        """
        dimension = dimension_of(dataset, _STIFFNESS)
        cycles, settles = dataset[self.of].notnull(), dataset["status"] == Status.NO_LIMIT_CYCLE
        lost = refused(dataset, self.of, dimension)
        answers = cycles.astype(float).where((cycles | settles) & ~lost)
        linear = _linear_boundary(answers.isel({dimension: 0}, drop=True), dataset)
        if linear is None:
            return xr.Dataset()
        stiffness = dataset[_STIFFNESS].astype(float)
        stable, unstable, crossings = xr.apply_ufunc(
            _bracket,
            answers,
            stiffness,
            input_core_dims=[[dimension], [dimension]],
            output_core_dims=[[], [], []],
            vectorize=True,
        )
        edge, width = (0.5 * (stable + unstable)).where(crossings == 1), abs(stable - unstable)
        misplaced = ((answers == 1.0) & (stiffness > linear)) | (
            (answers == 0.0) & (stiffness < linear)
        )
        along = [d for d in dataset[self.across].dims if d in linear.dims]
        whole = ~lost.any(along)
        made = {
            self.name: edge,
            f"{self.name}_error": 0.5 * width.where(crossings == 1),
            f"{self.name}_stable": stable,
            f"{self.name}_unstable": unstable,
            f"{self.name}_crossings": crossings,
            f"{self.name}_linear": linear,
            f"{self.name}_farthest": (abs(edge - linear) / width).max(along).where(whole),
            f"{self.name}_misplaced": misplaced.sum([dimension, *along]).where(whole),
        }
        note = f"between cells with a number and without one in {self.of}, along {_STIFFNESS}"
        if bool(failed(dataset["status"]).any()):
            note += "; cells along it failed or are missing"
        return xr.Dataset(
            {name: values.assign_attrs(comment=note) for name, values in made.items()}
        )


def _bracket(answers: np.ndarray, stiffness: np.ndarray) -> tuple[float, float, float]:
    """The stiffest of the cells that cycle and the softest of those that settle next to where the
    answer changes, as (settling, cycling), and how often it does.
    """
    order = [i for i in np.argsort(stiffness) if not np.isnan(answers[i])]
    if not order:
        return np.nan, np.nan, np.nan
    cycles, at = answers[order] > 0.5, stiffness[order]
    changes = np.flatnonzero(cycles[1:] != cycles[:-1])
    if changes.size == 0:
        return (np.nan, at[-1], 0.0) if cycles[0] else (at[0], np.nan, 0.0)
    below, above = at[changes[-1]], at[changes[-1] + 1]
    ends = (above, below) if cycles[changes[-1]] else (below, above)
    return *ends, float(changes.size)


def _linear_boundary(places: xr.DataArray, dataset: xr.Dataset) -> xr.DataArray | None:
    """Critical stiffness at V_0 over that at V_*, at each place of a lattice; None where a scene
    cannot be told from its coordinates alone.
    """
    named = {name: dataset[name] for name in (*SLOT_NAMES, *FIELDS) if name in dataset.coords}
    values = np.full(places.shape, np.nan)
    for place in np.ndindex(places.shape):
        at = dict(zip(places.dims, place, strict=True))
        here = {
            name: along.isel({d: i for d, i in at.items() if d in along.dims}).item()
            for name, along in named.items()
            if set(along.dims) <= set(at)
        }
        try:
            scene = _scene(here)
        except InvalidValue:
            return None
        values[place] = critical_stiffness(scene, scene.log_load_rate) / scene.critical_stiffness
    return places.copy(data=values)


def _scene(values: Mapping[str, Any]) -> Scene:
    """The scene with these values, at critical stiffness; coordinates hold NaN and "" for none."""
    given = {name: value for name, value in values.items() if value not in ("", None)}
    given = {n: bool(v) if isinstance(True, KINDS[n]) else v for n, v in given.items()}
    idle = {*without_meaning(given), "stiffness", _STIFFNESS}
    return Scene(**{n: v for n, v in given.items() if n not in idle and v == v})
