"""Programs that send a datagram every millisecond, each in its own process.

`python senders.py NAME PORT SECONDS` sends to PORT of this machine until the time is up.
"""

import socket
import sys
import time

PERIOD = 0.001  # s


def to(port: int) -> socket.socket:
    """Socket connected to the listener."""
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.connect(("127.0.0.1", port))
    return link


def slipbench(port: int, seconds: float) -> None:
    """The loop of slipbench as in a trial: each tick is written to the ring, then sent.

    Prints the lateness of every tick as the recording has it.
    """
    from slipbench.bench.loop.clock import MILLISECOND, MonotonicClock
    from slipbench.bench.loop.loop import run_periodic
    from slipbench.bench.loop.realtime_process import realtime_process
    from slipbench.bench.loop.ring import create_shared
    from slipbench.bench.loop.ticks import tick_recorder

    link, most = to(port), round(seconds / PERIOD)
    memory, ring = create_shared(1 << 18)

    def tick(number: int, _due: int) -> bool:
        link.send(number.to_bytes(8, "little"))
        return number < most - 1

    with realtime_process() as refused:
        done = run_periodic(tick, MILLISECOND, MonotonicClock(), most, tick_recorder(ring))
    ring.release()
    memory.close()
    memory.unlink()
    for text in refused:
        sys.stderr.write(text + "\n")
    sys.stdout.write(f"{done.due} {done.skipped}\n")
    sys.stdout.write(" ".join(map(str, done.lateness.tolist())))


def python_can(port: int, seconds: float) -> None:
    """python-can's cyclic task, on a bus whose `send` is one datagram."""
    import can

    class Datagrams(can.BusABC):
        def __init__(self) -> None:
            self.link, self.number, self.channel_info = to(port), 0, "datagrams"
            super().__init__(channel="datagrams")

        def send(self, _message: can.Message, timeout: float | None = None) -> None:
            self.link.send(self.number.to_bytes(8, "little"))
            self.number += 1

    with Datagrams() as bus:
        task = bus.send_periodic(can.Message(arbitration_id=0x10, data=bytes(8)), PERIOD)
        time.sleep(seconds)
        task.stop()


def hilspy(port: int, seconds: float) -> None:
    """hilspy's periodic message, sent from its own thread in Rust."""
    import hilspy as peer

    with (
        peer.open(f"udp://127.0.0.1:{port}") as channel,
        channel.every(PERIOD, peer.Message(data=bytes(8))),
    ):
        time.sleep(seconds)


if __name__ == "__main__":
    senders = {"slipbench": slipbench, "python-can": python_can, "hilspy": hilspy}
    senders[sys.argv[1]](int(sys.argv[2]), float(sys.argv[3]))
