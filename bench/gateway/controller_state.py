"""Whether our CAN controller is on the bus, from error frames and from the state of the interface.

A controller with too many errors leaves the bus (bus-off) and then receives and sends nothing.
SocketCAN reports that in an error frame (linux/can/error.h); other interfaces of python-can give it
as `state`; with those that do neither, only refused frames show it.
"""

import can

from slipbench.bench.bus.error_frames import ACTIVE, BUS_OFF, CONTROLLER, RESTARTED


class ControllerState:
    """State of the controller of one bus."""

    def __init__(self, bus: can.BusABC) -> None:
        """The controller counts as on the bus until it reports otherwise."""
        self._bus = bus
        self._off = False
        self._went_off = False
        self._has_state = True
        self.error_frames = 0

    def error_frame(self, message: can.Message) -> None:
        """Evaluate an error frame."""
        self.error_frames += 1
        number, data = message.arbitration_id, bytes(message.data)
        active = number & CONTROLLER and len(data) > 1 and data[1] & ACTIVE
        if number & BUS_OFF:
            self._off = self._went_off = True
        elif number & RESTARTED or active:
            self._off = False

    def off(self) -> bool:
        """Whether the controller is off the bus, or was since the last call."""
        went_off, self._went_off = self._went_off, False
        return self._off or went_off or self._reports_off()

    def _reports_off(self) -> bool:
        if not self._has_state:
            return False
        try:
            return self._bus.state is can.BusState.ERROR
        except NotImplementedError:
            self._has_state = False
            return False
        except can.CanError:
            return True  # the interface is no longer usable
