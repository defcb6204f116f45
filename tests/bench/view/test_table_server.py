"""Laws of the server of tables: without a token nothing, and from the page nothing can be changed."""

import pytest

from slipbench.bench.view.access import Access
from slipbench.protocol.errors import InputError

pytest.importorskip("starlette", reason="pip install 'slipbench[view]'")
pytest.importorskip("httpx2", reason="starlette's test client needs it: pip install httpx2")

from starlette.testclient import TestClient

from slipbench.bench.view.table_server import table_application

HOST = "http://bench:8470"
LOCAL = "http://127.0.0.1:8470"
FILES = ("", "season.js", "season.css", "view.css", "uplot.iife.min.js")


def echo(asked):
    if "wrong" in asked:
        raise InputError("this is wrong", remedy="ask for something else")
    return {"asked": dict(asked)}


def served(*, open_to_all):
    access = Access(open_to_all)
    return access, table_application({"echo": echo}, "season", access, "view")


def test_without_a_token_nothing_is_served():
    access, app = served(open_to_all=False)
    for token in (None, "", "wrong", access.read_token[:-1]):
        client = TestClient(app, base_url=HOST, cookies={} if token is None else {"view": token})
        for name in (*FILES, "answers/echo", "answers/none"):
            assert client.get(f"/{name}").status_code == 403


@pytest.mark.parametrize("right", ["read_token", "trip_token"])
def test_with_a_token_the_page_and_its_answers_are_served(right):
    access, app = served(open_to_all=False)
    client = TestClient(app, base_url=HOST, cookies={"view": getattr(access, right)})
    for name in FILES:
        assert client.get(f"/{name}").status_code == 200
    answer = client.get("/answers/echo", params={"where": "a = 'b' & c"})
    assert answer.json() == {"asked": {"where": "a = 'b' & c"}}


def test_another_host_name_is_refused_where_no_token_is_needed():
    _, app = served(open_to_all=True)
    assert TestClient(app, base_url=LOCAL).get("/answers/echo").status_code == 200
    assert TestClient(app, base_url="http://evil.example").get("/answers/echo").status_code == 403


def test_wrong_input_comes_back_with_its_message():
    _, app = served(open_to_all=True)
    answer = TestClient(app, base_url=LOCAL).get("/answers/echo", params={"wrong": "1"})
    assert answer.status_code == 400
    assert "ask for something else" in answer.json()["error"]


def test_what_there_is_not_is_not_found_and_nothing_can_be_sent():
    _, app = served(open_to_all=True)
    client = TestClient(app, base_url=LOCAL)
    assert client.get("/answers/none").status_code == 404
    assert client.get("/view.js").status_code == 404
    for name in ("", "answers/echo"):
        assert client.post(f"/{name}").status_code == 405
