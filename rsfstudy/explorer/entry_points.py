"""Functions that show a view in a notebook or in a browser.

The main functions are ``explore`` and ``serve``.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

from rsfstudy.errors import RunError
from rsfstudy.exception_conversion import raise_only_rsfstudy_errors
from rsfstudy.explorer.view_creation import create_view


@raise_only_rsfstudy_errors
def explore(source: Any = None, state: str | None = None) -> Any:
    """Show a scene, a results dataset or a record with widgets in a notebook.

    The function needs Panel. On the command line, ``rsfstudy explore`` opens the same views in a
    browser.

    Parameters
    ----------
    source : Scene, Rig, Record, xarray.Dataset or path, optional
        Object to show. The default is a scene with the default values. A dataset or a file may
        contain the results of a study, a motion, or a record.
    state : str, optional
        Settings of the widgets, as the tab "Code" of a view shows them.

    Returns
    -------
    panel.viewable.Viewable
        Panel object, which a notebook displays.

    Raises
    ------
    RunError
        If Panel is not installed.
    InvalidValue
        If ``source`` or ``state`` is invalid.

    Examples
    --------
    >>> import rsfstudy
    >>> scene = rsfstudy.Scene(law="slowness", load_velocity_ratio=2.0)
    >>> page = rsfstudy.explore(scene)  # doctest: +SKIP
    """
    _check_panel_is_installed()
    return create_view(source, state).build_page()


def serve(
    source: Any = None,
    widget_state_json: str | None = None,
    *,
    port: int | None = None,
    open_browser: bool = True,
    address_callback: Callable[[str], None] = print,
) -> None:
    """Serve a view to the browser of this computer until the process is interrupted.

    Parameters
    ----------
    source : Scene, Rig, Record, xarray.Dataset or path, optional
        Object to show, as for ``explore``.
    widget_state_json : str, optional
        Settings of the widgets.
    port : int, optional
        Port of the server. The default is 8067, or a free port if that port is in use.
    open_browser : bool, default: True
        If True, the page is opened in the browser.
    address_callback : callable, default: print
        Function that receives the first address of the page.

    Raises
    ------
    RunError
        If Panel is not installed.
    InvalidValue
        If the port is in use.
    """
    _check_panel_is_installed()
    server = importlib.import_module("rsfstudy.explorer.server").ExplorerServer(
        source, widget_state_json, port
    )
    server.run(open_browser=open_browser, address_callback=address_callback)


def _check_panel_is_installed() -> None:
    """Raise ``RunError`` if Panel is not installed."""
    if find_spec("panel") is None:
        raise RunError(
            "The explorer needs Panel, which is not installed. Install it with "
            "pip install 'rsfstudy[explore]'."
        )
