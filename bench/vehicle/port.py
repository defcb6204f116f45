"""Port of the virtual motorcycle: its frames on one bus, as changed by the faults of its nodes."""

from collections.abc import Iterator, Mapping

import can

from slipbench.bench.bus.faults import FaultPlan
from slipbench.bench.bus.frame import Frame
from slipbench.bench.bus.opening import interface_down
from slipbench.bench.vehicle.node_faults import GATEWAY, NodeFaults
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.codec import Frame as WireFrame


class Port:
    """Data frames in and out. Times in s since the simulation began."""

    def __init__(
        self,
        bus: can.BusABC,
        codec: Codec,
        nodes: Mapping[str, str],
        plan: FaultPlan,
        number: int = 0,
    ) -> None:
        """Use `bus`, which has this number. nodes: by message of the database.

        Raises InputError where no node can have the faults of `plan`.
        """
        self._bus, self._codec, self._nodes, self._number = bus, codec, nodes, number
        self._faults = NodeFaults(plan) if plan.faults else None

    def receive(self, now: float) -> list[Frame]:
        """Frames that have reached the nodes by `now`, in order."""
        arrived = list(self._waiting())
        if self._faults is None:
            return arrived
        for frame in arrived:
            self._faults.receive(frame, self._node(frame), now)
        self._pass_on(now)
        return self._faults.arriving(now)

    def send(self, made: WireFrame, now: float) -> None:
        """Send a frame of a simulated node. A full queue loses it, as on a real device."""
        frame = Frame(made.identifier, made.data, made.extended, fd=len(made.data) > 8)
        if self._faults is None:
            self._transmit(frame)
        else:
            self._faults.send(frame, self._node(frame), now)
            self._pass_on(now)

    def _pass_on(self, now: float) -> None:
        """Transmit the frames that the faults let leave by `now`."""
        for frame in self._faults.leaving(now) if self._faults else ():
            self._transmit(frame)

    def _node(self, frame: Frame) -> str:
        plan = self._codec.plan(frame.identifier, frame.extended, self._number)
        return GATEWAY if plan is None else self._nodes.get(plan.message.name, GATEWAY)

    def _waiting(self) -> Iterator[Frame]:
        while (message := self._bus.recv(0)) is not None:
            if not (message.is_error_frame or message.is_remote_frame):
                yield Frame(message.arbitration_id, bytes(message.data), message.is_extended_id)

    def _transmit(self, frame: Frame) -> None:
        message = can.Message(
            arbitration_id=frame.identifier,
            data=frame.data,
            is_extended_id=frame.extended,
            is_fd=frame.fd,
        )
        try:
            self._bus.send(message)
        except can.CanOperationError as refusal:
            if interface_down(refusal):
                raise
            return  # its counter shows the lost frame
