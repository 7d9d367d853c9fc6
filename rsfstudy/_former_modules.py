"""Former module paths, which can still be imported until version 1.0.0.

Importing a public module under its former path emits a ``DeprecationWarning``.
"""

from __future__ import annotations

import importlib
import sys
import warnings
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

#: Pairs of new module paths, relative to ``rsfstudy``, by former module path. The first path of a
#: pair is the module that now contains the names. The second path of a pair is the public module
#: from which users import the names. Both paths are empty for former packages without public names.
REPLACEMENT_MODULES_BY_FORMER_MODULE = {
    "analysis": ("", ""),
    "analysis.fitting": ("", ""),
    "analysis.fitting.filters": ("fitting.filters", "fitting"),
    "analysis.fitting.record": ("fitting.record", "fitting"),
    "declare": ("", ""),
    "declare.catalogue": ("study.study_loader", "study"),
    "declare.figure": ("study.figure_declarations", "study"),
    "measures.critical_step": ("critical_steps.critical_step", "measures"),
    "measures.elasticities": ("measure_base.elasticities", "measures"),
    "measures.fit": ("fitting.fit_measure", "measures"),
    "measures.healing": ("responses.healing", "measures"),
    "measures.limit_cycle": ("limit_cycles.limit_cycle", "measures"),
    "measures.linear_stability": ("responses.linear_stability", "measures"),
    "measures.rigid_response": ("responses.rigid_response", "measures"),
    "measures.step_response": ("responses.step_response", "measures"),
    "measures.triggered": ("critical_steps.triggered_instability", "measures"),
    "measures.velocity_step": ("responses.velocity_step", "measures"),
    "quantity": ("quantities", "measures"),
    "reduce": ("reductions", ""),
    "reduce.base": ("study.reductions.base", "reductions"),
    "reduce.boundaries": ("study.reductions.boundaries", "reductions"),
    "reduce.comparisons": ("study.reductions.comparisons", "reductions"),
    "reduce.fits": ("study.reductions.fits", "reductions"),
    "reduce.samples": ("study.reductions.statistics", "reductions"),
    "reduce.sobol_indices": ("study.reductions.sobol_indices", "reductions"),
    "rig.laboratory": ("rig.rig", "rig"),
    "rig.reductions": ("study.reductions.unit_conversion", "reductions"),
    "slider.places": ("slider.parameter_layout", "parts"),
    "slider.protocol": ("slider.user_loadings", "slider"),
}


class FormerModuleFinder(MetaPathFinder, Loader):
    """Import hook that finds modules under their former paths."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the import specification for the former path of a module.

        Parameters
        ----------
        fullname : str
            Full name of the module to import.
        path : sequence of str or None
            Search path of the parent package. This argument is ignored.
        target : module, optional
            Module object to reload. This argument is ignored.

        Returns
        -------
        ModuleSpec or None
            Specification of the module. The value is None if the name is not a former path.
        """
        top, _, name = fullname.partition(".")
        if top != "rsfstudy" or name not in REPLACEMENT_MODULES_BY_FORMER_MODULE:
            return None
        _present, public = REPLACEMENT_MODULES_BY_FORMER_MODULE[name]
        if public:
            text = f"The module {fullname} is deprecated. Import from rsfstudy.{public}."
            warnings.warn(text, DeprecationWarning, stacklevel=2)
        is_package = any(
            other.startswith(f"{name}.") for other in REPLACEMENT_MODULES_BY_FORMER_MODULE
        )
        return ModuleSpec(fullname, self, is_package=is_package)

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return a module that forwards to the module at the new path.

        Parameters
        ----------
        spec : ModuleSpec
            Specification of the module with the former path.

        Returns
        -------
        module
            Module object for the former path.
        """
        return _ModuleForwardingToNewPath(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        """Do nothing, because the module at the new path contains the code.

        Parameters
        ----------
        module : module
            Module that ``create_module`` returned.
        """


class _ModuleForwardingToNewPath(ModuleType):
    """Module that forwards attribute access to the module at the new path."""

    def __getattr__(self, name: str) -> Any:
        """Look up an attribute in the module at the new path."""
        present, _public = REPLACEMENT_MODULES_BY_FORMER_MODULE[self.__name__.partition(".")[2]]
        if not present or (name.startswith("__") and name != "__all__"):
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        return getattr(importlib.import_module(f"rsfstudy.{present}"), name)

    def __dir__(self) -> list[str]:
        """Return the names in the module at the new path."""
        present, _public = REPLACEMENT_MODULES_BY_FORMER_MODULE[self.__name__.partition(".")[2]]
        return dir(importlib.import_module(f"rsfstudy.{present}")) if present else []


def install_former_module_finder() -> None:
    """Insert the import hook before the finders that search the file system.

    The hook is inserted only once.
    """
    if not any(isinstance(finder, FormerModuleFinder) for finder in sys.meta_path):
        sys.meta_path.insert(0, FormerModuleFinder())
