"""What a cell costs beyond its physics, measured: ``python tests/scale.py``.

Trivial cells at 10^3, 10^4 and 10^5, each size in a process of its own: time and driver memory a
cell, bytes on disk. Then a real lattice on one worker and on two, in turns.
"""

from __future__ import annotations

import json
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from faulty import Faulty

import rsfstudy
from rsfstudy import Axis, Scene, Study


def lattice(cells: int) -> Study:
    """Ten rows of cells that take no time."""
    return Study(
        name="scale",
        title="Cells that cost nothing",
        base=Scene(),
        axes=[
            Axis("a", np.linspace(0.01, 0.02, 10)),
            Axis("b_over_a", np.linspace(1.5, 3.0, cells // 10)),
        ],
        measure=Faulty(),
    )


def peak() -> int:
    """Largest memory of this process so far, in bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def measured(cells: int, workers: int, format: str = "netcdf") -> dict[str, float]:
    """One run, in this process."""
    options = {"workers": workers, "progress": False, "format": format}
    with tempfile.TemporaryDirectory() as output:
        rsfstudy.run(lattice(100), output=output, **options)
    with tempfile.TemporaryDirectory() as output:
        before, began = peak(), time.perf_counter()
        rsfstudy.run(lattice(cells), output=output, **options)
        seconds = time.perf_counter() - began
        sizes = {p.suffix: p.stat().st_size for p in Path(output).iterdir() if p.is_file()}
    return {
        "ms": 1e3 * seconds / cells,
        "bytes": (peak() - before) / cells,
        "file": sizes.get(".nc", 0) / cells,
        "journal": sizes[".sqlite"] / cells,
    }


def apart(cells: int, workers: int, format: str = "netcdf") -> dict[str, float]:
    """One run, in a process of its own."""
    words = [sys.executable, __file__, str(cells), str(workers), format]
    said = subprocess.run(words, capture_output=True, text=True, check=True)
    found: dict[str, float] = json.loads(said.stdout)
    return found


def speed_up(repeats: int = 3) -> list[float]:
    """Time on one worker over time on two, for a lattice of 4,500 rate steps."""
    ratios = []
    for _ in range(repeats):
        times = []
        for workers in (1, 2):
            with tempfile.TemporaryDirectory() as output:
                began = time.perf_counter()
                rsfstudy.run(
                    "rate_step_boundary",
                    b_over_a=np.linspace(1.3, 6.0, 1500),
                    workers=workers,
                    output=output,
                    progress=False,
                )
                times.append(time.perf_counter() - began)
        ratios.append(times[0] / times[1])
        print(f"  {times[0]:.1f} s on one worker, {times[1]:.1f} s on two: {ratios[-1]:.2f}")
    return ratios


def main() -> None:
    """Print the tables of the README."""
    print("| cells | workers | ms a cell | driver, bytes a cell | file | journal |")
    for cells in (10**3, 10**4, 10**5):
        for workers in (0, 2):
            found = apart(cells, workers)
            print(
                f"| {cells:,} | {workers} | {found['ms']:.3f} | {found['bytes']:.0f} "
                f"| {found['file']:.0f} | {found['journal']:.0f} |"
            )
    found = apart(10**5, 2, "zarr")
    print(f"| 100,000 (zarr) | 2 | {found['ms']:.3f} | {found['bytes']:.0f} | |")
    print("\n4,500 rate steps:")
    ratios = speed_up()
    print(f"  median {statistics.median(ratios):.2f}")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        print(json.dumps(measured(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3])))
    else:
        main()
