"""Whether our CAN controller is on the bus: what it tells in error frames, and what it answers.

A controller that met too many errors leaves the bus (bus-off) and then hears and sends nothing.
SocketCAN says so in an error frame (linux/can/error.h); other interfaces of python-can answer when
asked for `state`; some do neither, and there only refused frames tell.
"""

import can

from slipbench.bench.bus.error_frames import ACTIVE, BUS_OFF, CONTROLLER, RESTARTED


class ControllerState:
    """What is known of the controller behind one bus."""

    def __init__(self, bus: can.BusABC) -> None:
        """Believe that the controller is on the bus until it says otherwise."""
        self._bus = bus
        self._off = False
        self._went_off = False
        self._answers = True
        self.error_frames = 0

    def heard(self, message: can.Message) -> None:
        """Take in an error frame."""
        self.error_frames += 1
        number, data = message.arbitration_id, bytes(message.data)
        active = number & CONTROLLER and len(data) > 1 and data[1] & ACTIVE
        if number & BUS_OFF:
            self._off = self._went_off = True
        elif number & RESTARTED or active:
            self._off = False

    def off(self) -> bool:
        """Tell whether the controller is off the bus, or was since this was asked last."""
        went_off, self._went_off = self._went_off, False
        return self._off or went_off or self._says_so()

    def _says_so(self) -> bool:
        if not self._answers:
            return False
        try:
            return self._bus.state is can.BusState.ERROR
        except NotImplementedError:
            self._answers = False
            return False
        except can.CanError:
            return True  # the bus itself is gone
