"""One bus of the gateway: its controller, what was sent on it, and what it refused."""

from collections.abc import Set

import can

from slipbench.bench.gateway.controller_state import ControllerState
from slipbench.bench.gateway.stamps import Stamp
from slipbench.bench.gateway.tx_echo import Key, TxEcho

OFF_THE_BUS = 3  # frames refused in a row; a single one is a queue that is full for a moment


class GatewayBus:
    """State of one bus.

    number        of the bus, see `Codec.buses`
    ours          keys of the messages that only the bench sends on it
    stamp         turns its time stamps into the recording's time
    refused       frames that it refused in a row
    records_sent  it does not echo what the bench sends; set where the gateway fails
    """

    __slots__ = ("controller", "echo", "number", "ours", "port", "records_sent", "refused", "stamp")

    def __init__(self, number: int, port: can.BusABC, ours: Set[Key], stamp: Stamp) -> None:
        """Nothing was sent yet. port: must receive its own frames."""
        self.number, self.port, self.ours, self.stamp = number, port, ours, stamp
        self.echo, self.controller = TxEcho(), ControllerState(port)
        self.refused = 0
        self.records_sent = False

    def off(self) -> bool:
        """Whether it is off, or was since the last call."""
        return self.controller.off() or self.refused >= OFF_THE_BUS
