"""Interactive views of scenes, results and records, in a browser or a notebook.

A view consists of widgets and plots. A view calls public functions of rsfstudy for every
computation, so this package contains no physics. A view never writes files. If you download a
figure or data, the browser saves the file. The modules are:

- ``entry_points`` contains the functions ``explore`` and ``serve``.
- ``view_creation`` chooses the view of a scene, a dataset or a file.
- ``base_view`` contains the base class ``ExplorerView``, which adds code, downloads and messages to
  a view.
- ``error_messages`` formats the messages of errors.
- ``background_jobs`` runs computations in a thread, with a progress bar and a cancel button.
- ``server`` serves the views to the browser of this computer only.
- ``scene_view``, ``results_view`` and ``record_view`` contain one view each.

The explorer needs Panel, which ``pip install 'rsfstudy[explore]'`` installs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.explorer.entry_points import explore, serve
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__, {"explorer.entry_points": ("explore", "serve")}
    )

__all__ = ["explore", "serve"]
