"""Which broker may serve the virtual bus, and which nodes may stay on it."""

import os
import resource
import subprocess
import sys
import uuid
from contextlib import ExitStack, suppress

import can
import pytest

from slipbench.bench.bus.broker import MOST_MEMBERS, address
from slipbench.bench.bus.python_can import SlipbenchBus
from tests.bench.bus.wires import PATIENCE

IDLE = """
import resource, socket, sys
resource.setrlimit(resource.RLIMIT_NOFILE, (int(sys.argv[2]) + 50,) * 2)
links = []
for _ in range(int(sys.argv[2])):
    link = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    link.connect(bytes.fromhex(sys.argv[1]))
    links.append(link)
print("connected", flush=True)
sys.stdin.read()
"""
LISTEN = """
import os, socket, sys
os.setuid(65534)
listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
listener.bind(bytes.fromhex(sys.argv[1]))
listener.listen(8)
print("listens", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def channel() -> str:
    return f"test {uuid.uuid4()}"


def program(text: str, *arguments: object) -> "subprocess.Popen[str]":
    """Program that runs until its input ends, after its first line of output."""
    process = subprocess.Popen(
        [sys.executable, "-c", text, *map(str, arguments)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout
    assert process.stdout.readline()
    return process


def exchanges(one: SlipbenchBus, other: SlipbenchBus, identifier: int) -> bool:
    """Whether a frame of one arrives at the other."""
    one.send(can.Message(arbitration_id=identifier, is_extended_id=False))
    while (heard := other.recv(PATIENCE)) is not None:
        if heard.arbitration_id == identifier:
            return True
    return False


@pytest.mark.skipif(
    resource.getrlimit(resource.RLIMIT_NOFILE)[1] < 1300,
    reason="needs 1300 open files: raise the hard limit (ulimit -Hn)",
)
@pytest.mark.parametrize("count", [MOST_MEMBERS, 1080])
def test_idle_connections_keep_no_node_from_the_bus(channel: str, count: int) -> None:
    with SlipbenchBus(channel) as one, SlipbenchBus(channel) as two:
        with program(IDLE, address(channel).hex(), count) as idle:
            assert exchanges(one, two, 0x123)
            with SlipbenchBus(channel) as three:
                assert exchanges(three, one, 0x321)
            assert idle.stdin
            idle.stdin.close()
        assert exchanges(one, two, 0x124)


FEW = """
import resource
from slipbench.bench.bus.python_can import SlipbenchBus
resource.setrlimit(resource.RLIMIT_NOFILE, (14, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))
import sys
with SlipbenchBus(sys.argv[1]) as bus:
    print("started", flush=True)
    sys.stdin.read()
"""


def test_a_broker_without_descriptors_rejects_new_nodes_and_serves_the_others(
    channel: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It inherits the limit of the program that started it."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, sys.path)))
    with program(FEW, channel) as first, ExitStack() as open_nodes:
        nodes: list[SlipbenchBus] = []
        with suppress(can.CanInitializationError):
            nodes += (open_nodes.enter_context(SlipbenchBus(channel)) for _ in range(20))
        assert 2 <= len(nodes) < 20
        assert exchanges(nodes[0], nodes[1], 0x123)
        assert first.stdin
        first.stdin.close()


@pytest.mark.skipif(os.getuid() != 0, reason="needs a second user: run as root")
def test_a_broker_of_another_user_is_rejected(channel: str) -> None:
    with program(LISTEN, address(channel).hex()) as other:
        with pytest.raises(can.CanInitializationError, match="user 65534 has taken") as told:
            SlipbenchBus(channel)
        assert "choose another channel" in str(told.value)
        assert other.stdin
        other.stdin.close()
