"""An encoder that tells its teeth as the database prescribes.

It does not imitate: transits that vary, electrical noise, a clock that drifts.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.dbc import MOTORBIKE, MOTORBIKE_FD
from slipbench.protocol.codec.codec import Codec, Sender
from slipbench.protocol.codec.messages import EncoderStatus, Intervals, ToothIntervals
from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Database

WAIT = 8_000  # us that the oldest tooth waits in the encoder at most
TRANSIT = 300  # us from sending to arrival
STATUS = 100_000  # us between statuses
SINGLE = (Intervals.SINGLE, 1, 2**42)


@dataclass(frozen=True)
class Sent:
    """A frame on the bus: arrival (us), identifier, payload, and the true count that it tells."""

    arrival: int
    identifier: int
    payload: bytes
    count: int
    anchor: bool


@dataclass(frozen=True)
class Encoder:
    """layouts: each with its most intervals and their longest (us), the fullest first."""

    database: Database
    layouts: tuple[tuple[Intervals, int, int], ...]

    @property
    def modulo(self):
        return 1 << self.database.message("RearTeeth").signal("tooth_count").length

    def frames(self, times, first_count=0):
        """Tooth frames and statuses of teeth at `times` (us), in the order of arrival."""
        sender, sent = Sender(Codec(self.database)), []
        told, status = 0, int(times[0])
        for tooth in range(1, len(times)):
            while status < times[tooth]:
                sent.append(self._status(sender, status, tooth - 1 + first_count, times[tooth - 1]))
                status += STATUS
            pending = np.diff(times[told : tooth + 1]).tolist()
            if len(pending) == self.layouts[0][1] or times[tooth] - times[told] >= WAIT:
                for layout, intervals in self._parts(pending):
                    told += len(intervals)
                    count = told + first_count
                    sent.append(self._teeth(sender, int(times[tooth]), layout, count, intervals))
        return sorted(sent, key=lambda frame: frame.arrival)

    def _status(self, sender, now, count, time):
        message = EncoderStatus(count, time * 1e-6, 16, False)
        frame = sender.encode(message, name="RearEncoderStatus")
        return Sent(now + 2 * TRANSIT, *frame, count, anchor=True)

    def _teeth(self, sender, now, layout, count, intervals):
        message = ToothIntervals(layout, count, tuple(each * 1e-6 for each in intervals))
        return Sent(now + TRANSIT, *sender.encode(message, name="RearTeeth"), count, anchor=False)

    def _parts(self, pending):
        while pending:
            layout, most, _ = next(
                each for each in self.layouts if max(pending[: each[1]]) <= each[2]
            )
            yield layout, pending[:most]
            pending = pending[most:]


ENCODERS = {
    "classic": Encoder(
        load_database(MOTORBIKE),
        ((Intervals.SHORT, 3, 2**14 - 1), (Intervals.LONG, 2, 2**20 - 1), SINGLE),
    ),
    "fd": Encoder(
        load_database(MOTORBIKE_FD),
        ((Intervals.SHORT, 10, 2**16 - 1), (Intervals.LONG, 8, 2**20 - 1), SINGLE),
    ),
}
