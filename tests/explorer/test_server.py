"""Tests of the server of the explorer: token, cookie, loopback and the command."""

import http.client
import re
import subprocess
import sys

import psutil
import pytest

from rsfstudy.errors import InvalidValue
from rsfstudy.explorer import serve


def ask(server, path, cookie="", **headers):
    """Send a request, and return the status, the headers and the text of the answer."""
    connection = http.client.HTTPConnection(server.origin.removeprefix("http://"), timeout=60)
    headers |= {"Cookie": cookie} if cookie else {}
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    text = answer.read().decode()
    connection.close()
    return answer.status, dict(answer.getheaders()), text


def log_in(server):
    """Return the headers of the answer to the first address, which contain a cookie."""
    status, headers, _text = ask(server, server.scene.removeprefix(server.origin))
    assert status == 302
    return headers


def upgrade(**headers):
    """Return the headers that open a websocket."""
    key = {"Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==", "Sec-WebSocket-Version": "13"}
    protocol = {"Sec-WebSocket-Protocol": "bokeh, token"}
    return {"Upgrade": "websocket", "Connection": "Upgrade"} | key | protocol | headers


@pytest.mark.parametrize(
    "path", ["/", "/?token=wrong", "/ws", "/autoload.js", "/static/js/bokeh.min.js", "/missing"]
)
def test_a_request_without_token_is_refused(server, path):
    status, headers, text = ask(server, path)
    assert (status, "Set-Cookie" in headers) == (403, False)
    assert "rsfstudy explore" in text
    name = log_in(server)["Set-Cookie"].partition("=")[0]
    assert ask(server, path, cookie=f"{name}=wrong")[0] == 403


def test_a_websocket_without_cookie_is_refused(server):
    own = {"Origin": server.origin}
    assert ask(server, "/ws", **upgrade(**own))[0] == 403
    cookie = log_in(server)["Set-Cookie"].partition(";")[0]
    foreign = {"Origin": "http://example.org"}
    assert ask(server, "/ws", cookie, **upgrade(**foreign))[0] == 403


def test_the_first_address_sets_a_cookie_and_loses_its_token(server):
    headers = log_in(server)
    assert {"HttpOnly", "SameSite=Strict", "Path=/"} <= set(headers["Set-Cookie"].split("; "))
    assert headers["Location"] == "/"
    status, _headers, text = ask(server, "/", headers["Set-Cookie"].partition(";")[0])
    assert status == 200
    assert not re.search(r"(src|href)=.?https?://", text)
    assert ask(server, "/static/js/bokeh.min.js")[0] == 403


def test_nothing_listens_beyond_loopback(server):
    connections = psutil.Process(server.process.pid).net_connections("inet")
    listening = {each.laddr for each in connections if each.status == psutil.CONN_LISTEN}
    assert {each.ip for each in listening} == {"127.0.0.1"}


def test_a_port_in_use_is_refused(server):
    port = int(server.origin.rpartition(":")[2])
    with pytest.raises(InvalidValue, match=f"--port = {port} cannot be used"):
        serve(port=port, open_browser=False)


def test_without_panel_the_command_names_the_extra():
    hidden = "import sys; sys.modules['panel'] = None; import importlib.util as u; "
    hidden += "found = u.find_spec; u.find_spec = lambda n, *p: None if n == 'panel' else found(n)"
    code = f"{hidden}; import rsfstudy; rsfstudy.explore()"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "pip install 'rsfstudy[explore]'" in ran.stderr.splitlines()[-1]
