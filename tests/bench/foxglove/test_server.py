"""Laws of the server: loopback alone, a port in use is an error, and a slow client costs only itself."""

import json
import socket

import pytest

pytest.importorskip("foxglove", reason="pip install 'slipbench[foxglove]'")
pytest.importorskip("websockets", reason="pip install websockets")

from slipbench.bench.foxglove import server as module
from slipbench.bench.foxglove.replay_thread import closing_server, folder_stream
from slipbench.bench.foxglove.server import Server
from slipbench.bench.view.access import Address
from slipbench.bench.view.commands import FOXGLOVE_PORT, foxglove_address
from slipbench.protocol.errors import InputError
from slipbench.protocol.export.json_messages import object_schema, quantity_schema
from tests.bench.foxglove.client import client

FREE = Address(port=0)
SCHEMA = object_schema("Number", "", {"number": quantity_schema("", kind="integer")})


@pytest.fixture
def taken():
    """A port that another program uses."""
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen()
        yield listening.getsockname()[1]


def numbers(viewer, topic="/n"):
    return [tree["number"] for _, tree in viewer.values(topic)]


def test_a_chosen_port_that_is_in_use_is_an_error_with_a_remedy(taken):
    with pytest.raises(InputError, match="cannot use this port") as fault:
        Server("test", Address(port=taken, chosen=True))
    assert "--foxglove-port" in str(fault.value)
    assert str(taken) in str(fault.value)


def test_without_a_chosen_port_the_next_free_one_is_taken(taken):
    with closing_server(Server("test", Address(port=taken))) as server:
        assert server.url.startswith("ws://127.0.0.1:")
        assert str(taken) not in server.url
        with client(server.url) as viewer:
            assert viewer.info["name"] == "test"


def test_the_options_give_the_address():
    assert foxglove_address(False, None) is None
    assert foxglove_address(True, None) == Address(port=FOXGLOVE_PORT)
    assert foxglove_address(False, 9000) == Address(port=9000, chosen=True)


def test_no_other_address_of_the_machine_is_served():
    """Where the machine has one: a connection to it is refused."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(("192.0.2.1", 9))  # sends nothing; chooses the outgoing address
        address = probe.getsockname()[0]
    if address.startswith("127."):
        pytest.skip("this machine has no address but the loopback one")
    with closing_server(Server("test", FREE)) as server:
        port = int(server.url.rpartition(":")[2])
        with pytest.raises((ConnectionRefusedError, TimeoutError)):
            socket.create_connection((address, port), timeout=1.0)


def test_a_client_of_another_protocol_is_refused():
    from websockets.exceptions import InvalidStatus
    from websockets.sync.client import connect

    with closing_server(Server("test", FREE)) as server:
        with pytest.raises(InvalidStatus):
            connect(server.url)
        with pytest.raises(InvalidStatus):
            connect(server.url, subprotocols=["rosbridge"])


def test_topics_that_are_advertised_again_stay_and_others_are_withdrawn():
    with closing_server(Server("test", FREE)) as server:
        server.advertise({"/n": SCHEMA, "/old": SCHEMA})
        with client(server.url) as viewer:
            viewer.subscribe("/n")
            viewer.receive(0.2)
            assert server.wanted() == {"/n"}
            server.advertise({"/n": SCHEMA, "/new": SCHEMA})
            server.send("/n", 1, b'{"number":1}')
            viewer.receive(0.2)
            assert set(viewer.channels) == {"/n", "/new"}
            assert numbers(viewer) == [1]


def test_a_slow_client_loses_its_oldest_messages_is_warned_and_others_lose_nothing(monkeypatch):
    monkeypatch.setattr(module, "BACKLOG", 1000)
    text = b'{"number":%d}' + b" " * 1000
    with closing_server(Server("test", FREE)) as server:
        server.advertise({"/n": SCHEMA})
        with client(server.url) as slow, client(server.url) as quick:
            slow.subscribe("/n")
            quick.subscribe("/n")
            quick.receive(0.2)
            for number in range(30_000):
                server.send("/n", number, text % number)
                if number % 250 == 0:  # the quick one reads, the slow one does not
                    quick.until(lambda number=number: numbers_last(quick) == number)
            server.set_time(30_000)
            quick.receive(0.3)
            slow.receive(0.3)
            kept = numbers(slow)
            assert numbers(quick) == list(range(30_000))
            assert kept == sorted(set(kept))
            assert len(kept) < 30_000
            assert kept[-1] == 29_999
            assert slow.statuses == quick.statuses
            assert ["too slow" in text for text in quick.statuses] == [True]


def numbers_last(viewer):
    messages = viewer.messages.get("/n")
    return json.loads(messages[-1][1])["number"] if messages else None


def test_a_run_that_cannot_be_replayed_is_an_error(tmp_path):
    with pytest.raises(InputError), folder_stream(tmp_path, True, FREE, print):
        pass
