"""Laws of who may do what: without a token nothing, read-only no trip, and no page can do more."""

import json

import pytest

from slipbench.bench.loop.clock import MonotonicClock
from slipbench.bench.view.access import Access, Address, Right, address_of
from slipbench.bench.view.live_run import LiveView
from slipbench.protocol.errors import InputError

pytest.importorskip("starlette", reason="pip install 'slipbench[view]'")
pytest.importorskip("httpx2", reason="starlette's test client needs it: pip install httpx2")

from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from slipbench.bench.view.server import NAMES, application
from slipbench.bench.view.sources import LiveSource

HOST = "http://bench:8470"
LOCAL = "http://127.0.0.1:8470"


class Bench:
    """A server whose trips are counted."""

    def __init__(self, folder, *, open_to_all, base):
        self.access, self.trips, self.base = Access(open_to_all), 0, base
        source = LiveSource(LiveView(folder / "run", MonotonicClock()))
        self.app = application(source, self.access, "view", self.trip)

    def trip(self):
        self.trips += 1
        return True

    def client(self, token=None):
        cookies = {} if token is None else {"view": token}
        return TestClient(self.app, base_url=self.base, cookies=cookies)


@pytest.fixture
def remote(tmp_path):
    return Bench(tmp_path, open_to_all=False, base=HOST)


@pytest.fixture
def local(tmp_path):
    return Bench(tmp_path, open_to_all=True, base=LOCAL)


def test_without_a_token_nothing_is_served(remote):
    for token in (None, "", "wrong", "%C3%A9", remote.access.trip_token[:-1]):
        client = remote.client(token)
        for name in ("", *NAMES):
            assert client.get(f"/{name}").status_code == 403
        assert client.post("/trip", headers={"origin": HOST}).status_code == 403
        with pytest.raises(WebSocketDisconnect), client.websocket_connect("/live"):
            pass
    assert remote.trips == 0


def test_a_token_in_the_address_becomes_a_cookie_that_scripts_cannot_read(remote):
    client = remote.client()
    moved = client.get("/", params={"token": remote.access.read_token}, follow_redirects=False)
    assert (moved.status_code, moved.headers["location"]) == (303, "/")
    cookie = moved.headers["set-cookie"].lower()
    assert "httponly" in cookie
    assert "samesite=strict" in cookie
    assert client.get("/").status_code == 200


def test_a_read_only_viewer_sees_and_cannot_trip(remote):
    client = remote.client(remote.access.read_token)
    with client, client.websocket_connect("/live") as socket:
        assert json.loads(socket.receive_text())["right"] == Right.READ.value
    assert client.post("/trip", headers={"origin": HOST}).status_code == 403
    assert remote.trips == 0


def test_a_viewer_with_the_right_trips_once(remote):
    client = remote.client(remote.access.trip_token)
    assert client.post("/trip", headers={"origin": HOST}).json() == {"tripped": True}
    assert remote.trips == 1


@pytest.mark.parametrize("origin", [None, "http://evil.example", "null", "http://bench"])
def test_another_web_site_cannot_trip(remote, local, origin):
    headers = {} if origin is None else {"origin": origin}
    for bench in (remote, local):
        client = bench.client(bench.access.trip_token)
        assert client.post("/trip", headers=headers).status_code == 403
        assert bench.trips == 0


def test_a_name_that_was_pointed_at_this_machine_is_refused(local):
    client = local.client()
    for host in ("evil.example", "evil.example:8470", "127.0.0.1.evil.example"):
        headers = {"host": host, "origin": f"http://{host}"}
        assert client.get("/", headers=headers).status_code == 403
        assert client.post("/trip", headers=headers).status_code == 403
    assert local.trips == 0
    assert client.get("/").status_code == 200


MESSAGES = ["arm", "start", "trip", '{"trip": true}', '{"arm": true}', '{"seek": 1}', "[]", "{", ""]


def test_no_message_of_a_page_does_anything(remote):
    client = remote.client(remote.access.trip_token)
    with client, client.websocket_connect("/live") as socket:
        for message in MESSAGES:
            socket.send_text(message)
            assert json.loads(socket.receive_text())["type"] in ("hello", "update")
    assert remote.trips == 0


def test_trip_is_the_only_request_that_changes_anything(remote):
    methods = {
        route.path: route.methods - {"GET", "HEAD"}
        for route in remote.app.routes
        if getattr(route, "methods", None)
    }
    assert {path: found for path, found in methods.items() if found} == {"/trip": {"POST"}}


def test_a_trip_where_no_trial_runs_is_said(tmp_path):
    source = LiveSource(LiveView(tmp_path, MonotonicClock()))
    client = TestClient(application(source, Access(True), "view"), base_url=LOCAL)
    assert client.post("/trip", headers={"origin": LOCAL}).status_code == 409


def test_tokens_differ_and_are_not_shown():
    one, other = Access(False), Access(False)
    assert len({one.trip_token, one.read_token, other.trip_token, other.read_token}) == 4
    assert one.trip_token not in repr(one)


@pytest.mark.parametrize(
    ("text", "address", "loopback"),
    [
        ("127.0.0.1", Address("127.0.0.1"), True),
        ("localhost:9000", Address("localhost", 9000, chosen=True), True),
        ("0.0.0.0:80", Address("0.0.0.0", 80, chosen=True), False),
        ("::1", Address("::1"), True),
        ("[::]:8470", Address("::", 8470, chosen=True), False),
        ("pitwall", Address("pitwall"), False),
    ],
)
def test_addresses(text, address, loopback):
    assert address_of(text) == address
    assert address.loopback is loopback


@pytest.mark.parametrize("text", ["a:b", "a:99999", "a:-1"])
def test_an_address_that_is_none_is_refused(text):
    with pytest.raises(InputError, match="no address of a view"):
        address_of(text)
