"""Functions that load named studies and study files.

``load_study`` is the main function.
"""

from __future__ import annotations

import difflib
import importlib
import importlib.util
import os
import sys
import traceback
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from rsfstudy.errors import InvalidValue
from rsfstudy.path_checks import check_path_is_valid
from rsfstudy.study.named_study_index import NAMED_STUDIES_PACKAGE, list_study_names

if TYPE_CHECKING:
    from rsfstudy.study.study import Study


def load_study(name_or_file: str) -> Study:
    """Load a named study, or the study in a Python file.

    Parameters
    ----------
    name_or_file : str
        Name of a study, or path of a Python file that assigns a `Study` to the variable ``study``.

    Returns
    -------
    Study
        Declaration of the study.

    Raises
    ------
    InvalidValue
        If there is no study with this name, if the file cannot be read or raises an exception, or
        if the file does not declare a study. For an unknown name, the message lists similar names.
    """
    check_path_is_valid("study", name_or_file)
    if name_or_file.endswith(".py"):
        return replace(
            _read_study_from_module(_import_study_file(Path(name_or_file)), name_or_file),
            source_file=name_or_file,
        )
    if name_or_file not in list_study_names():
        near = difflib.get_close_matches(name_or_file, list_study_names(), n=3, cutoff=0.6)
        remedy = (
            "Run `rsfstudy list` to see all names, or pass the path of a study file "
            "(path/to/study.py)."
        )
        if os.path.isfile(f"{name_or_file}.py"):
            near, remedy = (
                [],
                (f"To load the file in the current directory, write {name_or_file}.py."),
            )
        raise InvalidValue("study", name_or_file, "is unknown", choices=near, remedy=remedy)
    study: Study = importlib.import_module(f"{NAMED_STUDIES_PACKAGE}.{name_or_file}").study
    return study


def _import_study_file(study_file: Path) -> ModuleType:
    """Import a study file as a module.

    The module and the modules in the same directory are removed from ``sys.modules`` after the
    import. Worker processes cannot import the removed modules, and therefore receive the contents
    of these modules by value. After the removal, another study file can import different modules
    with the same names.
    """
    try:
        path = study_file.resolve(strict=True)
        if not path.is_file():  # Reading a pipe or a device may block.
            raise InvalidValue("study", str(study_file), "is not a regular file")
        path.read_bytes()
    except (OSError, RuntimeError) as error:  # Circular links raise a RuntimeError.
        reason = getattr(error, "strerror", None) or error
        raise InvalidValue("study", str(study_file), f"cannot be read ({reason})") from error
    spec = importlib.util.spec_from_file_location(f"study_file_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    known = set(sys.modules)
    sys.modules[spec.name] = module
    sys.path.insert(0, str(path.parent))  # The file may import modules in its directory.
    try:
        spec.loader.exec_module(module)
    except InvalidValue as error:
        raise error.with_location(f"{path}{_format_line_number_of_error(error, path)}") from error
    except SyntaxError as error:
        place = f"{error.filename or path}, line {error.lineno}"
        raise InvalidValue(
            "study", str(path), f"has a syntax error in {place}: {error.msg}"
        ) from error
    except (Exception, SystemExit) as error:
        rule = f"raises {type(error).__name__}{_format_line_number_of_error(error, path)}: {error}"
        raise InvalidValue("study", str(path), rule) from error
    finally:
        sys.path.remove(str(path.parent))
        for name in [
            n for n in sys.modules if n not in known and _is_module_in_directory_of(n, path)
        ]:
            del sys.modules[name]
    return module


def _is_module_in_directory_of(module_name: str, study_file: Path) -> bool:
    """Return True if a module or its package is in the directory of a study file."""
    top = sys.modules.get(module_name.partition(".")[0])
    places = [getattr(top, "__file__", None), *getattr(top, "__path__", ())]
    return any(Path(place).parent == study_file.parent for place in places if place)


def _format_line_number_of_error(error: BaseException, study_file: Path) -> str:
    """Format the line number at which an error was raised in the study file.

    The string is empty if the error was not raised in the study file.
    """
    lines = [
        frame.lineno
        for frame in traceback.extract_tb(error.__traceback__)
        if Path(frame.filename) == study_file
    ]
    return f", line {lines[-1]}" if lines else ""


def _read_study_from_module(module: ModuleType, study_name: str) -> Study:
    """Return the study that a module declares."""
    # This import is slow and is not needed to list the names of studies.
    from rsfstudy.study.study import Study

    study = getattr(module, "study", None)
    if not isinstance(study, Study):
        raise InvalidValue(
            "study",
            study_name,
            "does not define a study",
            remedy="Define, for example, study = Study(...).",
        )
    if study.name in list_study_names():
        rule = (
            f"defines the study {study.name!r}, but rsfstudy already has a study with this "
            "name, and both studies would write the same files"
        )
        raise InvalidValue("study", study_name, rule, remedy="Choose another name.")
    return study
