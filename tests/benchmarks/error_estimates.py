"""Comparison of error estimates with the errors relative to reference values.

Usage: ``python tests/benchmarks/error_estimates.py KIND COUNT SEED``, where KIND is
``elasticities``, ``inertia``, ``inverse`` or ``all``. COUNT is the number of random cases.
The reference values of elasticities are extrapolated differences, computed with rtol =
1e-11. The reference values of motions with inertia are computed with tolerances a thousand
times smaller. The exact curves are known for ``Inverse``. The script prints each error that
exceeds its estimate. The exit status is 1 if the estimates cover too few of the errors.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.optimize import brentq

from rsfstudy import Scene
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.measure_base.elasticities import Elasticities
from rsfstudy.measures import Measure
from rsfstudy.motion.accuracy import MIN_RTOL, Accuracy
from rsfstudy.reductions import Inverse, apply_reductions
from rsfstudy.responses.healing import Healing
from rsfstudy.responses.velocity_step import VelocityStep
from rsfstudy.status import Status

Random = np.random.Generator
#: Steps in ln p for the extrapolated differences.
STEPS = (0.004, 0.002, 0.001, 0.0005)
#: Kinds of curves, and the largest fraction of curves that may be flagged.
CURVES = {"smooth": 0.0, "kinked": 0.2, "oscillating": 0.2}


class Number(NamedTuple):
    """Computed value and reference value of an output.

    The computed value has an error estimate, and the reference value has an uncertainty.
    """

    label: str
    value: float
    estimate: float
    reference: float
    uncertainty: float
    work: int = 0

    @property
    def error(self) -> float:
        """Absolute error in excess of rounding and reference uncertainty."""
        rounding = 1e-12 * abs(self.reference)
        return max(abs(self.value - self.reference) - self.uncertainty - rounding, 0.0)


def decades(random: Random, low: float, high: float) -> float:
    """Draw a number from a log-uniform distribution."""
    return float(math.exp(random.uniform(math.log(low), math.log(high))))


def random_slider(random: Random) -> dict[str, Any]:
    """Draw a law, a normal stress condition and their parameters."""
    fields: dict[str, Any] = {
        "law": str(random.choice(["slip", "slowness", "perrin_rice_zheng"])),
        "normal_stress": str(random.choice(["constant", "variable"])),
        "a": decades(random, 0.003, 0.025),
        "b_over_a": 1.0 + decades(random, 0.05, 3.0),
        "mu_star": float(random.uniform(0.5, 0.85)),
    }
    if fields["normal_stress"] == "variable":
        lowest = math.degrees(math.atan(fields["mu_star"]))
        fields["phi"] = lowest + random.uniform(0.05, 0.95) * (90.0 - lowest)
        fields["alpha"] = float(random.uniform(0.02, 0.6))
    return fields


# ---- elasticities --------------------------------------------------------------------------------


def elasticity_number(random: Random) -> Iterator[Number]:
    """Compute an elasticity of a random scene, and its reference value.

    The measure is a critical step or a limit cycle.
    """
    fields = random_slider(random)
    measure: Measure = CriticalStep(
        str(random.choice(["load_velocity_ratio", "displacement_step"]))
    )
    if random.uniform() < 1.0 / 3.0:
        measure = LimitCycle(phases=2)
        fields |= {"inertia": True, "load_velocity_ratio": decades(random, 1.1, 100.0)}
        fields |= {"stiffness_ratio": float(random.uniform(0.4, 0.97))}
    else:
        fields["stiffness_ratio"] = float(random.uniform(1.02, 2.5))
    names = ["b_over_a", "b_over_a", "a", "stiffness_ratio", "mu_star"]
    name = str(random.choice(names + ["alpha"] * ("alpha" in fields)))
    accuracy = Accuracy(10.0 ** -random.integers(5, 10), engine="compiled", budget=5_000_000)
    scene = Scene(**fields)
    outcome = Elasticities(measure, (name,))(scene, accuracy)
    if outcome.status is not Status.OK:
        return
    names_of_both = "elasticity", "elasticity_error"
    value, estimate = (float(np.ravel(outcome.values[key])[0]) for key in names_of_both)
    reference, uncertainty = extrapolated_elasticity(measure, scene, name)
    if math.isfinite(value + reference):
        label = f"{measure.name} by {name} at {accuracy.rtol:g}: {fields}"
        yield Number(label, value, estimate, reference, uncertainty, outcome.rhs_evaluations)


def extrapolated_elasticity(measure: Measure, scene: Scene, name: str) -> tuple[float, float]:
    """Extrapolate central differences of ln|y| to step 0.

    The second return value is the uncertainty of the extrapolation.
    """
    accuracy = Accuracy(MIN_RTOL, engine="compiled", budget=20_000_000)

    def level(by: float) -> float:
        outcome = measure(scene.with_(**{name: getattr(scene, name) * math.exp(by)}), accuracy)
        value = float(outcome.values.get(measure.primary_output, math.nan))
        return math.log(abs(value))

    best, rows = (math.inf, math.nan), list[list[float]]()
    for step in STEPS:
        row = [(level(step) - level(-step)) / (2.0 * step)]
        for column, before in enumerate(rows[-1] if rows else []):
            row.append(row[column] + (row[column] - before) / (4.0 ** (column + 1) - 1.0))
            apart = abs(row[-1] - row[-2]) + abs(row[-1] - before)
            best = min(best, (apart, row[-1]))
        rows.append(row)
    return best[1], best[0]


# ---- readings with inertia -----------------------------------------------------------------------


def inertia_numbers(random: Random) -> Iterator[Number]:
    """Measure a random hold or velocity step with inertia.

    The function yields all values and their error estimates.
    """
    fields = random_slider(random) | {"inertia": True, "reference_rate": 1e-3}
    fields["stiffness_ratio"] = decades(random, 1.1, 100.0)
    fields["period"] = 2.0 * math.pi * decades(random, 1e-5, 0.3) / fields["reference_rate"]
    fields["load_velocity_ratio"] = decades(random, 0.03, 30.0)
    measure: Measure = VelocityStep(phases=2)
    if random.uniform() < 0.5:
        measure, fields["hold_time"] = Healing(phases=2), decades(random, 1.0, 1e5)
    rtol, scene = 10.0 ** -random.integers(4, 9), Scene(**fields)
    outcomes = [
        measure(scene, Accuracy(tolerance, engine="compiled", budget=60_000_000))
        for tolerance in (rtol, max(1e-3 * rtol, MIN_RTOL))
    ]
    if any(outcome.status is not Status.OK for outcome in outcomes):
        return
    (found, exact), work = (each.values for each in outcomes), outcomes[0].rhs_evaluations
    for name in measure.names_of_outputs_with_error:
        value, estimate, reference, uncertainty = (
            float(values[key]) for values in (found, exact) for key in (name, f"{name}_error")
        )
        if math.isfinite(value + reference):
            label = f"{name} at {rtol:g}: {fields}"
            yield Number(label, value, estimate, reference, uncertainty, work)


# ---- inverse -------------------------------------------------------------------------------------


def draw_curve(kind: str, random: Random, length: float, cells: int) -> Callable[[Any], Any]:
    """Draw an increasing curve of ln y against ln x, from 0 to ``length``."""
    slope, bend = random.uniform(0.3, 3.0), random.uniform(-0.4, 0.5)
    if kind == "smooth" and random.uniform() < 0.5:
        rate = random.uniform(0.3, 4.0) / length
        return lambda at: slope * np.sinh(rate * at) / rate
    if kind == "kinked":
        kink, change = random.uniform(0.1, 0.9) * length, random.uniform(-0.55, 4.0) * slope
        return lambda at: (
            slope * (at + bend * at**2 / (2.0 * length)) + change * np.maximum(at - kink, 0.0)
        )
    rate = 2.0 * math.pi * random.uniform(0.5, 0.4 * cells) / length
    size = 0.0 if kind == "smooth" else random.uniform(0.1, 1.2) * slope / rate
    phase = random.uniform(0.0, 2.0 * math.pi)
    return lambda at: (
        slope * (at + bend * at**2 / (2.0 * length)) + size * np.sin(rate * at + phase)
    )


def inverse_numbers(kind: str, random: Random) -> tuple[list[Number], int]:
    """Apply ``Inverse`` to a random curve, and compare the exact crossings.

    The second return value is the status of the result.
    """
    cells, length = int(random.integers(5, 17)), math.log(10.0) * random.uniform(0.7, 3.0)
    curve = draw_curve(kind, random, length, cells)
    x = np.linspace(0.0, length, cells)
    if random.uniform() < 0.5:
        x[1:-1] = np.sort(random.uniform(0.02, 0.98, cells - 2)) * length
    level = float(curve(random.uniform(0.02, 0.98) * length))
    dataset = xr.Dataset(
        {"y": ("x", np.exp(curve(x))), "status": ("x", np.zeros(cells, np.int8))},
        coords={"x": np.exp(x)},
    )
    found = apply_reductions(dataset, (Inverse(name="at", of="y", on="x", levels=math.exp(level)),))
    fine = np.linspace(0.0, length, 4001)
    off = curve(fine) - level
    roots = [
        brentq(lambda at: float(curve(at)) - level, *fine[n : n + 2], xtol=1e-14)
        for n in np.flatnonzero(off[1:] * off[:-1] < 0.0)
    ]
    at, error = float(found["at"]), float(found["at_error"])
    status = int(found["at_status"])
    return [Number(kind, at, error, math.exp(root), 0.0) for root in roots if not status], status


# ---- all of them ---------------------------------------------------------------------------------


def print_coverage(title: str, numbers: list[Number], least: float) -> bool:
    """Print the coverage of error estimates.

    The return value is True if the coverage is at least ``least``.
    """
    missed = [number for number in numbers if number.error > number.estimate]
    for number in missed:
        print(f"  {number.error / number.estimate:.3g} times its estimate: {number.label}")
    ratios = [n.estimate / max(abs(n.value - n.reference), 1e-15) for n in numbers]
    share = 1.0 - len(missed) / max(len(numbers), 1)
    work = sum(number.work for number in numbers)
    text = f"{title}: {share:.2%} of {len(numbers)} covered, median of estimate over error "
    print(f"{text}{np.median(ratios):.3g}, {work:,} right-hand sides")
    return share >= least


def check_inverse(count: int, random: Random) -> bool:
    """Check ``Inverse`` for each kind of curve.

    Flagged results count as covered.
    """
    passed = True
    for kind, most in CURVES.items():
        numbers, flagged = list[Number](), 0
        for _ in range(count):
            # If the curve has several crossings, the largest error is used.
            found, status = inverse_numbers(kind, random)
            flagged += status != 0
            numbers += sorted(found, key=lambda number: number.error)[-1:]
        uncovered = sum(number.error > number.estimate for number in numbers)
        print(f"inverse, {kind}: {flagged} of {count} flagged")
        print_coverage(f"inverse, {kind}", numbers, 0.0)
        passed &= flagged <= most * count and uncovered <= 0.05 * count
    return passed


def check_random(
    title: str, draw: Callable[[Random], Iterator[Number]], count: int, seed: int
) -> bool:
    """Check the error estimates of random scenes."""
    numbers, random = list[Number](), np.random.default_rng(seed)
    while len(numbers) < count:
        numbers += draw(random)
    return print_coverage(title, numbers, 0.99)


def main(kind: str, count: int, seed: int) -> int:
    """Check one kind of error estimates, or all kinds."""
    passed = True
    if kind in ("inverse", "all"):
        passed &= check_inverse(count, np.random.default_rng(seed))
    for title, draw in (("elasticities", elasticity_number), ("inertia", inertia_numbers)):
        if kind in (title, "all"):
            passed &= check_random(title, draw, count, seed)
    return 0 if passed else 1


if __name__ == "__main__":
    KIND, *NUMBERS = sys.argv[1:] or ["all"]
    COUNT, SEED = [int(number) for number in NUMBERS] + [200, 0][len(NUMBERS) :]
    sys.exit(main(KIND, COUNT, SEED))
