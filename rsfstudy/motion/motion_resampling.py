"""Function that resamples a recorded motion at a given number of points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rsfstudy.motion.engine_factory import call_array_function_with_engine
from rsfstudy.motion.engines import SCIPY
from rsfstudy.motion.recording import (
    MOTION_VARIABLE_NAMES,
    SAMPLE_NUMBER_COLUMN,
    SAMPLES_PER_INTEGRATION_STEP,
    resample_along_path,
)

#: Columns of a recorded motion. The path length is computed from these columns.
_COLUMNS_DEFINING_PATH_LENGTH = tuple(
    MOTION_VARIABLE_NAMES.index(name) for name in ("time", "log10_slip_rate", "shear_stress")
)


def resample_motion_along_path(
    recorded_rows: np.ndarray,
    point_count: int,
    variable_names: Sequence[str] = MOTION_VARIABLE_NAMES,
    engine: str = SCIPY,
) -> dict[str, np.ndarray]:
    """Resample a recorded motion at points along its path.

    Half of the points are evenly spaced in path length, which is computed from time, ln V and
    stress. The other points are distributed in the same way as the integration steps. The
    integration steps are short where the path bends. The points include all extrema of slip rate
    and stress.

    Parameters
    ----------
    recorded_rows : ndarray
        Rows of a recorded motion.
    point_count : int
        Number of points.
    variable_names : sequence of str, default: MOTION_VARIABLE_NAMES
        Names of the returned variables. The variables must be the first columns of the table.
    engine : str, default: "scipy"
        Name of the engine that runs the resampling loop.

    Returns
    -------
    dict of str to ndarray
        Values of each variable at the points. The values are NaN if the table is empty.
    """
    if not len(recorded_rows):
        return {name: np.full(point_count, np.nan) for name in variable_names}
    columns, found = (
        np.ascontiguousarray(recorded_rows.T),
        np.empty((len(variable_names), point_count)),
    )
    path, at, room = (
        np.zeros(len(recorded_rows)),
        np.empty(point_count),
        np.empty(SAMPLES_PER_INTEGRATION_STEP + 1),
    )
    seen = [columns[place] for place in (*_COLUMNS_DEFINING_PATH_LENGTH, SAMPLE_NUMBER_COLUMN)]
    call_array_function_with_engine(
        resample_along_path, engine, columns, *seen, path, at, room, found
    )
    # Interpolation can make times decrease within a rupture because of rounding errors.
    np.maximum.accumulate(found[0], out=found[0])
    return dict(zip(variable_names, found, strict=True))
