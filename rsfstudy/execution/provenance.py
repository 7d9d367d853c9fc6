"""Provenance of results.

The function ``collect_run_fingerprint`` collects the fingerprint, which contains all settings,
versions and code digests that affect the results. The function ``collect_provenance`` collects the
provenance, which contains the fingerprint, the time, the command, the commit and the machine.
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
from rsfstudy.execution.module_import_graph import ModuleImportGraph
from rsfstudy.motion import Engine
from rsfstudy.slider import Scene

if TYPE_CHECKING:
    from rsfstudy.measures import Measure
    from rsfstudy.study import Study

_PACKAGE_DIRECTORY = Path(__file__).parent.parent
#: Subpackages of rsfstudy whose code affects the results of cells.
_PACKAGES_AFFECTING_CELL_RESULTS = (
    "slider",
    "parts",
    "motion",
    "measure_base",
    "critical_steps",
    "limit_cycles",
    "responses",
    "fitting",
)


def read_source_files_affecting_results(package_directory: Path) -> dict[str, bytes]:
    """Read the source files that may affect the results of cells.

    Parameters
    ----------
    package_directory : Path
        Directory of the package.

    Returns
    -------
    dict of str to bytes
        Contents of the source files, by path relative to ``package_directory``.
    """
    files = [
        file
        for part in _PACKAGES_AFFECTING_CELL_RESULTS
        for file in sorted((package_directory / part).rglob("*.py"))
    ]
    return {file.relative_to(package_directory).as_posix(): file.read_bytes() for file in files}


#: Import graph of the source files at the time of the import. The source files are read only once,
#: because later changes of the files do not affect the running code.
_import_graph_of_running_code = ModuleImportGraph(
    read_source_files_affecting_results(_PACKAGE_DIRECTORY)
)


def collect_code_fingerprint(
    engine: str = Engine.SCIPY, user_classes: Iterable[object] = ()
) -> dict[str, str]:
    """Collect the versions and code digests that affect the results of cells.

    Parameters
    ----------
    engine : str, optional
        Name of the engine.
    user_classes : iterable of object, default: ()
        Class of the measure, and classes of user-defined parts and steppers.

    Returns
    -------
    dict of str to str
        Versions and digests by name.
    """
    return {
        "physics": _import_graph_of_running_code.combined_digest,
        "own_code": code_digest.digest_user_classes(*user_classes),
        # The Python version affects the byte code.
        "python": f"{sys.version_info.major}.{sys.version_info.minor}",
        "numpy": version("numpy"),
        "scipy": version("scipy"),
        **find_engine_package_versions(engine),
    }


def digest_modules_affecting_results(
    measure: Measure, example_scenes: Iterable[Scene]
) -> dict[str, str]:
    """Compute the code digests of the modules that a measure and scenes use.

    The digests include all modules that the measure and the parts of the scenes import, directly or
    through other modules. If the measure is user-defined, all modules of rsfstudy are included,
    because the measure may use any of them. If a part is user-defined, all modules of the
    ``slider`` package are included.

    Parameters
    ----------
    measure : Measure
        Measure of the study.
    example_scenes : iterable of Scene
        One scene for each combination of slider parts.

    Returns
    -------
    dict of str to str
        Digest of each module, by name.
    """
    if not all(map(code_digest.is_defined_in_rsfstudy, measure.result_determining_classes)):
        return {
            **_import_graph_of_running_code.compute_digests(),
            **code_digest.digest_measures_of_named_studies(measure.result_determining_classes),
        }
    parts = {type(part) for scene in example_scenes for part in scene.parts}
    roots = {kind.__module__ for kind in (Scene, *measure.result_determining_classes, *parts)}
    if not all(map(code_digest.is_defined_in_rsfstudy, parts)):
        roots |= {
            f"rsfstudy.{name}"
            for name in _import_graph_of_running_code.module_names
            if name.startswith("slider.")
        }
    return _import_graph_of_running_code.compute_digests(roots)


def collect_run_fingerprint(study: Study, example_scenes: Iterable[Scene]) -> dict[str, Any]:
    """Collect all settings, versions and digests that affect the results.

    The fingerprint does not contain the scene fields or the scalar measure fields. The keys of the
    cells are computed from these fields instead.

    Parameters
    ----------
    study : Study
        Study to run.
    example_scenes : iterable of Scene
        One scene for each combination of slider parts in the lattice.

    Returns
    -------
    dict of str to object
        Fingerprint as plain data. The entry ``physics`` contains one code digest for each module
        that the measure and the parts of the scenes import directly or indirectly.
    """
    plain, accuracy = study.measure.scalar_field_values, study.accuracy
    return {
        "study": f"{study.name} version {study.version}",
        "measure": {n: v for n, v in study.measure.describe().items() if n not in plain},
        "rtol": accuracy.rtol,
        "budget": accuracy.budget,
        "methods": [list(pair) for pair in accuracy.methods],
        "engine": accuracy.engine,
        **collect_code_fingerprint(accuracy.engine, study.user_defined_classes),
        "physics": digest_modules_affecting_results(study.measure, example_scenes),
    }


def collect_provenance(
    study: Study, command_line: str, example_scenes: Iterable[Scene]
) -> dict[str, Any]:
    """Collect the provenance of a run.

    Parameters
    ----------
    study : Study
        Study to run.
    command_line : str
        Command line or Python call of the user.
    example_scenes : iterable of Scene
        One scene for each combination of slider parts in the lattice.

    Returns
    -------
    dict of str to object
        Time, command, versions, fingerprint, commit and machine, as plain data.
    """
    return {
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": command_line,
        "declared_in": study.source_file,
        "versions": {
            "python": platform.python_version(),
            **{name: version(name) for name in _PACKAGES_WITH_RECORDED_VERSION},
        },
        "fingerprint": collect_run_fingerprint(study, example_scenes),
        "git": read_git_commit_and_state(_PACKAGE_DIRECTORY.parent),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        "mathematical_library": " ".join(platform.libc_ver()).strip() or "unknown",
        "byte_order": sys.byteorder,
    }


def build_provenance_attributes(command_line: str) -> dict[str, str]:
    """Build the root attributes that describe the origin of a dataset.

    The function is used for datasets that contain a single scene.

    Parameters
    ----------
    command_line : str
        Command line or Python call of the user.

    Returns
    -------
    dict of str to str
        Attributes ``source`` and ``history``.
    """
    when = datetime.now(UTC).isoformat(timespec="seconds")
    return {"source": _build_cf_source_attribute(), "history": f"{when} {command_line}"}


@functools.cache
def _build_cf_source_attribute() -> str:
    """Build the value of the ``source`` attribute from the version and commit of rsfstudy."""
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
    """Return the commit of a Git checkout and its state (clean or changed).

    The function checks for changes only in the package, the named studies and ``pyproject.toml``,
    because changes in other files do not affect the results.

    Parameters
    ----------
    checkout_directory : Path
        Root directory of the checkout.

    Returns
    -------
    str
        Commit and state, such as "1a2b3c clean" or "1a2b3c with uncommitted changes". If the
        directory is not a checkout, the function returns the commit from which the installed wheel
        was built, or "none" if the commit is unknown.
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
            # Other files, such as the output files of runs, do not affect the results.
            changed = run_git(
                "status", "--porcelain", "--", _PACKAGE_DIRECTORY.name, "studies", "pyproject.toml"
            )
            state = "with uncommitted changes" if changed else "clean"
            return f"{run_git('rev-parse', 'HEAD')} {state}"
    # The build command in the module ``build_stamp`` writes this file.
    stamp = _PACKAGE_DIRECTORY / "commit.txt"
    return stamp.read_text().strip() if stamp.exists() else "none"


def find_engine_package_versions(engine_name: str) -> dict[str, str]:
    """Return the versions of the additional packages that an engine requires.

    The versions of NumPy and SciPy are not included, because ``collect_code_fingerprint`` adds
    these versions for all engines.

    Parameters
    ----------
    engine_name : str
        Name of the engine.

    Returns
    -------
    dict of str to str
        Versions by package name. The dictionary is empty unless the engine compiles the equations
        of motion.
    """
    if engine_name != Engine.COMPILED:
        return {}
    # The versions are read from the metadata, because importing numba would delay every command.
    from importlib.metadata import PackageNotFoundError, version

    try:
        return {"numba": version("numba"), "llvmlite": version("llvmlite")}
    except PackageNotFoundError:
        return {"numba": "not installed"}
