"""What decides the numbers of a run: versions and the code of the physics; and who made it, where
and how: machine, time, command.
"""

from __future__ import annotations

import contextlib
import functools
import os
import platform
import subprocess
import sys
from collections.abc import Iterable
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rsfstudy.execution import code_digest
from rsfstudy.motion import COMPILED, SCIPY

if TYPE_CHECKING:
    from rsfstudy.study import Study

_PACKAGE_DIRECTORY = Path(__file__).parent.parent
#: Code whose change may change a number.
_PACKAGES_THAT_DECIDE_NUMBERS = (
    "slider",
    "motion",
    "measure_base",
    "critical_steps",
    "limit_cycles",
    "responses",
    "fitting",
)


def read_physics_sources(package_directory: Path) -> dict[str, bytes]:
    """Source of everything that decides the number of a cell in every study, by the path in the
    package.
    """
    files = [
        file
        for part in _PACKAGES_THAT_DECIDE_NUMBERS
        for file in sorted((package_directory / part).rglob("*.py"))
    ]
    return {file.relative_to(package_directory).as_posix(): file.read_bytes() for file in files}


#: Read at import, because later changes to the files do not change the code that runs.
_PHYSICS_SOURCES_AT_IMPORT = read_physics_sources(_PACKAGE_DIRECTORY)


def code_fingerprint(engine: str = SCIPY, user_classes: Iterable[object] = ()) -> dict[str, str]:
    """Versions, and digests of code, that decide the numbers of a cell.

    Parameters
    ----------
    engine : str
    user_classes : iterable of type
        The classes of the measure, and parts and a stepper of the user's own.
    """
    return {
        "physics": _physics_digest(),
        "own_code": code_digest.digest_user_classes(*user_classes),
        "python": f"{sys.version_info.major}.{sys.version_info.minor}",  # whose code is digested
        "numpy": version("numpy"),
        "scipy": version("scipy"),
        **package_versions(engine),
    }


@functools.cache
def _physics_digest() -> str:
    return code_digest.digest_sources(_PHYSICS_SOURCES_AT_IMPORT)


def run_fingerprint(study: Study) -> dict[str, Any]:
    """All that decides the numbers of a cell, except its scene and its measure's plain fields."""
    plain, accuracy = study.measure.plain_fields, study.accuracy
    shared = code_fingerprint(accuracy.engine, study.user_classes)
    return {
        "study": f"{study.name} version {study.version}",
        "measure": {n: v for n, v in study.measure.describe().items() if n not in plain},
        "rtol": accuracy.rtol,
        "budget": accuracy.budget,
        "methods": [list(pair) for pair in accuracy.methods],
        "engine": accuracy.engine,
        **shared,
        "physics": code_digest.digest_physics_and_measures(
            shared["physics"], study.measure.code_classes
        ),
    }


def collect_provenance(study: Study, command_line: str) -> dict[str, Any]:
    """Where, when and from what a run was made, and by which versions.

    Parameters
    ----------
    study : Study
    command_line : str
        What the user typed.
    """
    return {
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": command_line,
        "declared_in": study.source_file,
        "versions": {
            "python": platform.python_version(),
            **{name: version(name) for name in _PACKAGES_WITH_RECORDED_VERSION},
        },
        "fingerprint": run_fingerprint(study),
        "git": read_git_commit_and_state(_PACKAGE_DIRECTORY.parent),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        "mathematical_library": " ".join(platform.libc_ver()).strip() or "unknown",
        "byte_order": sys.byteorder,
    }


def provenance_attributes(command_line: str) -> dict[str, str]:
    """Root attributes that say which rsfstudy made a dataset of one scene, when, and how.

    Parameters
    ----------
    command_line : str
        What the user typed, or called.
    """
    when = datetime.now(UTC).isoformat(timespec="seconds")
    return {"source": _build_source_attribute(), "history": f"{when} {command_line}"}


@functools.cache
def _build_source_attribute() -> str:
    commit = read_git_commit_and_state(_PACKAGE_DIRECTORY.parent)
    return f"rsfstudy {version('rsfstudy')}, commit {commit}, numerical model of a spring-slider"


_PACKAGES_WITH_RECORDED_VERSION = (
    "rsfstudy",
    "numpy",
    "scipy",
    "xarray",
    "dask",
    "distributed",
    "netCDF4",
)


def read_git_commit_and_state(checkout_directory: Path) -> str:
    """Commit of a checkout of this project, and whether what decides numbers was clean; where its
    root is none, as for an installed wheel, the commit that it was built from, or "none".
    """

    def run_git(*words: str) -> str:
        return subprocess.run(
            ["git", "-C", str(checkout_directory), *words],
            capture_output=True,
            text=True,
            check=True,
            timeout=300,
        ).stdout.strip()

    with contextlib.suppress(OSError, subprocess.SubprocessError):
        if Path(run_git("rev-parse", "--show-toplevel")) == checkout_directory.resolve():
            # what runs leave in the checkout changes nothing
            changed = run_git(
                "status", "--porcelain", "--", _PACKAGE_DIRECTORY.name, "studies", "pyproject.toml"
            )
            state = "with uncommitted changes" if changed else "clean"
            return f"{run_git('rev-parse', 'HEAD')} {state}"
    stamp = _PACKAGE_DIRECTORY / "commit.txt"  # as `stamp` writes it into a wheel
    return stamp.read_text().strip() if stamp.exists() else "none"


def package_versions(name: str) -> dict[str, str]:
    """Versions of what decides the numbers of an engine, beside those of SciPy."""
    if name != COMPILED:
        return {}
    # loading it would make each command wait
    from importlib.metadata import PackageNotFoundError, version

    try:
        return {"numba": version("numba"), "llvmlite": version("llvmlite")}
    except PackageNotFoundError:
        return {"numba": "not installed"}
