"""Web server of the explorer, which is accessible only from this computer.

The server listens on the loopback interface. The URL that is opened first contains a random token.
The server responds to this first request with a cookie, and redirects the browser to the URL
without the token, so that the token does not remain in the browser history. All other requests
require the cookie, including requests for scripts and websockets.
"""

from __future__ import annotations

import hmac
import secrets
import socket
import webbrowser
from collections.abc import Callable
from typing import Any
from urllib.parse import urlencode

import panel as pn
from panel.io.server import Server, get_server
from tornado.httputil import HTTPServerRequest
from tornado.routing import Matcher, Rule
from tornado.web import RequestHandler

from rsfstudy.errors import InvalidValue
from rsfstudy.explorer.background_jobs import redirect_warnings_to_browser_page
from rsfstudy.explorer.base_view import URL_ARGUMENT_OF_WIDGET_STATE, load_panel_extension
from rsfstudy.explorer.error_messages import create_error_page
from rsfstudy.explorer.view_creation import create_view

#: Address of the loopback interface, and port that is used by default if it is free.
HOST, DEFAULT_PORT = "127.0.0.1", 8067
_URL_ARGUMENT_OF_TOKEN = "token"


class ExplorerServer:
    """Web server of a single page, which displays the view of a source.

    Parameters
    ----------
    source : object
        Object or file that the page shows.
    state : str or None, optional
        Settings of the widgets when the page is opened.
    port : int or None, optional
        Port. By default, the server uses port 8067, or a free port if port 8067 is in use.

    Attributes
    ----------
    url : str
        First address, which contains the token.
    port : int
        Port on which the server listens.
    """

    def __init__(self, source: Any, state: str | None = None, port: int | None = None) -> None:
        """Bind the port and start to listen."""
        self.port = _find_free_port(port)
        token = secrets.token_urlsafe(32)
        load_panel_extension()
        self._server: Server = get_server(
            {"/": lambda: _build_page_of_view(source)},
            port=self.port,
            address=HOST,
            websocket_origin=f"{HOST}:{self.port}",
            title={"/": "rsfstudy explore"},
            start=False,
            show=False,
        )
        rules = [
            Rule(
                _MatcherOfRequestsWithToken(token),
                _LoginHandler,
                {"token": token, "port": self.port},
            ),
            Rule(_MatcherOfRequestsWithoutCookie(token, self.port), _ForbiddenRequestHandler),
        ]
        self._server._tornado.add_handlers(r".*", rules)  # these rules precede the pages
        query = {_URL_ARGUMENT_OF_TOKEN: token} | (
            {URL_ARGUMENT_OF_WIDGET_STATE: state} if state else {}
        )
        self.url = f"http://{HOST}:{self.port}/?{urlencode(query)}"

    def run(self, *, open_browser: bool, address_callback: Callable[[str], None]) -> None:
        """Serve the page until the process is interrupted.

        Parameters
        ----------
        open_browser : bool
            If True, the page is opened in the browser.
        address_callback : callable
            Function that receives the first address when the server is ready.
        """
        redirect_warnings_to_browser_page()
        self._server.start()
        address_callback(self.url)
        if open_browser:
            self._server.io_loop.call_later(0.1, webbrowser.open, self.url)
        try:
            self._server.io_loop.start()
        finally:
            self._server.stop()


def _build_page_of_view(source: Any) -> Any:
    """Build the page of a browser tab, or a page with an error message."""
    arguments = pn.state.session_args.get(URL_ARGUMENT_OF_WIDGET_STATE, [b""])
    try:
        return create_view(source, arguments[0].decode(errors="replace")).build_page()
    except Exception as error:
        return create_error_page(error)


def _find_free_port(requested_port: int | None) -> int:
    """Return a free port of the loopback interface.

    Raises
    ------
    InvalidValue
        If the requested port is in use.
    """
    for candidate in (requested_port,) if requested_port else (DEFAULT_PORT, 0):
        with socket.socket() as tried:
            tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                tried.bind((HOST, candidate))
            except OSError as error:
                if requested_port:
                    remedy = "Choose another --port, or omit it to use a free port."
                    rule = f"cannot be used ({error.strerror})"
                    raise InvalidValue("--port", requested_port, rule, remedy=remedy) from error
                continue
            return int(tried.getsockname()[1])
    raise AssertionError("the system provides a free port")


def _format_cookie_name(port: int) -> str:
    """Return the name of the cookie, which contains the port.

    The port is part of the name because a browser sends the cookies of a host to all its ports.
    """
    return f"rsfstudy-explore-{port}"


class _MatcherOfRequestsWithToken(Matcher):
    """Matcher of requests whose address contains the token."""

    def __init__(self, token: str) -> None:
        self._token = token.encode()

    def match(self, request: HTTPServerRequest) -> dict[str, Any] | None:
        """Return an empty dictionary if the request contains the token."""
        given = request.query_arguments.get(_URL_ARGUMENT_OF_TOKEN, [b""])[0]
        return {} if hmac.compare_digest(given, self._token) else None


class _MatcherOfRequestsWithoutCookie(Matcher):
    """Matcher of requests without a valid cookie."""

    def __init__(self, token: str, port: int) -> None:
        self._token, self._cookie = token.encode(), _format_cookie_name(port)

    def match(self, request: HTTPServerRequest) -> dict[str, Any] | None:
        """Return an empty dictionary if the request has no valid cookie."""
        morsel = request.cookies.get(self._cookie)
        given = (morsel.value if morsel else "").encode()
        return None if hmac.compare_digest(given, self._token) else {}


class _LoginHandler(RequestHandler):
    """Handler of the first request, which sets the cookie and removes the token."""

    def initialize(self, token: str, port: int) -> None:
        """Store the token, which is the value of the cookie."""
        self._token, self._port = token, port

    def get(self) -> None:
        """Set the cookie, and redirect to the address without the token."""
        self.set_cookie(
            _format_cookie_name(self._port), self._token, httponly=True, samesite="Strict", path="/"
        )
        self.set_header("Referrer-Policy", "no-referrer")
        rest = {n: self.get_query_argument(n) for n in self.request.query_arguments}
        del rest[_URL_ARGUMENT_OF_TOKEN]
        self.redirect("/" + (f"?{urlencode(rest)}" if rest else ""))


class _ForbiddenRequestHandler(RequestHandler):
    """Handler that refuses all requests."""

    def prepare(self) -> None:
        """Respond with the HTTP status 403, and explain how to open the page."""
        self.set_status(403)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(
            "This request has no valid cookie. Open the address that the command rsfstudy explore "
            "printed when it started.\n"
        )
