"""Comparison of error estimates of scenes with heat with actual errors.

Usage: ``python tests/benchmarks/heat_estimates.py EFFECT COUNT SEED``, where EFFECT is ``flash``,
``heating``, ``pressurisation`` or ``all``. The error of the largest of two peaks of slip rate after
a step is compared with its estimate. The reference values are computed by the independent
integration in time of ``time_domain_reference``. The script prints each error that exceeds its
estimate. The exit status is 1 if more than one error in 60 exceeds its estimate.
"""

from __future__ import annotations

import math
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from error_estimates import decades, random_slider

sys.path.insert(0, str(Path(__file__).parents[1]))
from time_domain_reference import TimeDomainMotion

from rsfstudy import Accuracy, Scene
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import StepResponse
from rsfstudy.motion.engines import COMPILED, SCIPY
from rsfstudy.status import Status

EFFECTS = ("flash", "heating", "pressurisation")
#: Error of the reference values, relative to the requested accuracy of ln V.
REFERENCE_ERROR = 2e-10


def random_fields(effect: str, random: np.random.Generator) -> dict[str, Any]:
    """Draw the fields of a scene with an effect of heat."""
    fields = random_slider(random)
    fields["a"], fields["b_over_a"] = decades(random, 0.005, 0.02), random.uniform(1.2, 2.5)
    fields |= {
        "radiation_damping": decades(random, 3e-4, 3e-3),
        "load_velocity_ratio": decades(random, 1.5, 5.0),
        "stiffness_ratio": float(random.uniform(0.5, 0.95)),
    }
    if effect == "flash":
        fields |= {
            "law": "flash_heating",
            "weakening_velocity_ratio": decades(random, 3.0, 30.0),
            "weakened_friction": float(random.uniform(0.2, 0.45)),
            "weakening_exponent": float(random.uniform(1.0, 4.0)),
        }
        return fields
    fields |= {
        "temperature": "shear_heating",
        "heating": decades(random, 1e-4, 1e-2),
        "cooling": decades(random, 0.03, 3.0),
    }
    if effect == "heating" or random.uniform() < 0.3:
        fields["direct_activation"] = float(random.uniform(0.0, 40.0))
        fields["evolution_activation"] = float(random.uniform(0.0, 40.0))
    if effect == "pressurisation":
        fields |= {"fluid": "thermal", "pressurisation": decades(random, 0.3, 3.0)}
        fields |= {"drainage": decades(random, 0.03, 3.0)}
        if random.uniform() < 0.4:
            fields["dilatancy"] = decades(random, 1e-4, 3e-3)
    return fields


def compare_peak(
    fields: dict[str, Any], rtol: float, engine: str = COMPILED
) -> tuple[float, float] | None:
    """Return the error of the largest peak and its estimate.

    The result is None if the scene is invalid, or if one of the motions ends early.
    """
    try:
        scene = Scene(**fields)
        scene = scene.with_(stiffness=scene.stiffness)
    except InvalidValue:
        return None
    outcome = StepResponse(peaks=2, phases=50)(scene, Accuracy(rtol, engine=engine))
    if outcome.status is not Status.OK:
        return None
    count = int(np.isfinite(outcome.values["peak_log10_slip_rate"]).sum())
    until = float(np.nanmax(outcome.values["time"])) * (1.0 + 1e-6) + 1e-6
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            ((*peaks,),) = TimeDomainMotion(scene).solve(
                [until], [lambda now: now.log_slip_rate_derivative], [-1.0]
            )[1]
        except (Warning, AssertionError):
            return None
    if count < 2 or len(peaks) < count:
        return None
    ln10 = math.log(10.0)
    known = max(now.log_slip_rate for _time, now in peaks[:count]) / ln10
    found = outcome.values["max_log10_slip_rate"]
    error = max(abs(found - known) - REFERENCE_ERROR, 0.0)
    return error, outcome.values["max_log10_slip_rate_error"]


def main(effect: str, count: int, seed: int) -> int:
    """Compare random scenes and print the errors that exceed their estimates."""
    status = 0
    for name in EFFECTS if effect == "all" else [effect]:
        random, covered, done, drawn = np.random.default_rng(seed), 0, 0, 0
        ratios = []
        while done < count and drawn < 20 * count:
            drawn += 1
            fields, rtol = random_fields(name, random), 10.0 ** -random.uniform(4.0, 8.0)
            compared = compare_peak(fields, rtol, SCIPY)
            if compared is None:
                continue
            error, estimate = compared
            done, covered = done + 1, covered + (error <= estimate)
            ratios.append(error / estimate)
            if error > estimate:
                print(f"{name}: {error:.2e} exceeds {estimate:.2e} at {rtol:.1e}: {fields}")
        median = float(np.median(ratios))
        print(f"{name}: {covered} of {done} covered ({drawn} drawn), median ratio {median:.2g}")
        status |= covered < done - max(1, done // 60) or done < count
    return int(status)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3])))
