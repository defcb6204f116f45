"""Frames of all devices on one bus, each at its time, as a candump log.

The bus sends some frames twice, at random: a receiver that saw an error in the last bit of a frame
has already taken it when its sender repeats it (CAN 2.0, section 3.1.5). The logger loses frames in
short bursts at random times.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slipbench.protocol.codec.encode import Bytes, encode
from slipbench.protocol.codec.frame_bits import frame_bits
from slipbench.protocol.codec.messages import Authority, Intervals, Phase
from slipbench.protocol.database.layout import Database
from slipbench.protocol.logs.frame_log import FrameLog
from slipbench.studies.blind_validation.generator.instruments import TEETH, Clock, Samples
from slipbench.studies.blind_validation.generator.physics import Floats
from slipbench.studies.blind_validation.generator.wire import Integers, arrivals, packed

BITRATE = 1e6  # bit/s
START = 1_000_000_000  # ns of the logger's epoch at which a recording begins
BUS = "can0"
MAP_ADVANCE = np.radians(36.0)
JITTER = 60e-6  # s, mean of what a device takes longer than its latency
MOST_TEETH, LONGEST_WAIT = 3, 5_000_000  # a frame's, and ns
STATUS_EVERY = 0.1  # s
AGAIN = 0.4e-3  # s, mean time until a frame is repeated
BURST = 3.0  # frames, mean length of what a logger loses at a time


@dataclass(frozen=True)
class Line:
    """Share of the frames that the bus repeats, and share that the logger loses."""

    repeated: float
    lost: float


NO_TROUBLE = Line(0.0, 0.0)


@dataclass(frozen=True)
class Sent:
    """Frames of one message. ready: s, true time at which they contend; data: (n, length)."""

    name: str
    ready: Floats
    data: Bytes


@dataclass(frozen=True)
class Devices:
    """All devices that send. clocks: by device; latency: s, from sample to frame."""

    database: Database
    clocks: Mapping[str, Clock]
    latency: float
    rng: np.random.Generator

    def message(self, name: str, clock: str, true: Floats, **columns: npt.ArrayLike) -> Sent:
        """Frames of a message with time stamps. true: true times of the n samples, s, shape (n,).

        clock: device that stamps; columns: signals of the message, SI, shape (n,).
        """
        late = self.latency + self.rng.exponential(JITTER, true.size)
        stamp = self.clocks[clock].read(true)
        data = encode(self.database, name, {**columns, "time": stamp})
        return Sent(name, np.maximum.accumulate(true + late), data)

    def unstamped(self, name: str, true: Floats, **columns: npt.ArrayLike) -> Sent:
        """Frames of a message without time stamps. true: true times of the n samples, s, shape (n,)."""
        ready = np.maximum.accumulate(true + self.rng.exponential(JITTER, true.size))
        return Sent(name, ready, encode(self.database, name, columns))

    def teeth(self, wheel: str, true: Floats, first: int) -> list[Sent]:
        """Tooth frames and status frames of an encoder. true: true times of the teeth, s, shape (n,).

        first: index of the first tooth on its disc.
        """
        stamps = np.floor(self.clocks[f"{wheel}_encoder"].read(true) * 1e6).astype(np.int64)
        stamps = np.maximum.accumulate(stamps + np.arange(stamps.size)) - np.arange(stamps.size)
        count = first + np.arange(stamps.size)
        frame = packed(np.asarray(true[1:] * 1e9, np.int64), MOST_TEETH, LONGEST_WAIT)
        begins = np.flatnonzero(np.diff(frame, prepend=-1))
        held = np.diff(np.append(begins, frame.size))
        step = np.append(np.diff(stamps), 0)
        columns: dict[str, npt.ArrayLike] = {
            f"short_interval_{k + 1}": np.where(
                k < held, step[np.minimum(begins + k, step.size - 1)], 0
            )
            for k in range(MOST_TEETH)
        }
        columns |= {
            "layout": np.full(held.size, int(Intervals.SHORT)),
            "tooth_count": count[begins + held],
        }
        # The sender polls each millisecond, so a tooth is not sent before the next poll.
        ready = np.ceil(true[begins + held] * 1e3) * 1e-3 + self.latency
        ready = np.maximum.accumulate(ready + self.rng.exponential(JITTER, ready.size))
        name = wheel.capitalize()
        return [
            Sent(f"{name}Teeth", ready, encode(self.database, f"{name}Teeth", columns)),
            self._status(name, true, stamps, count),
        ]

    def _status(self, name: str, true: Floats, stamps: Integers, count: Integers) -> Sent:
        at = np.arange(0.05, true[-1], STATUS_EVERY)
        last = np.searchsorted(true, at, side="right") - 1
        at, last = at[last >= 0], last[last >= 0]
        columns = {
            "tooth_count": count[last],
            "tooth_time": stamps[last] * 1e-6,
            "teeth_per_turn": np.full(last.size, TEETH),
        }
        return self.unstamped(f"{name}EncoderStatus", at, **columns)


def ecu_frames(devices: Devices, throttle: Samples, spark: Floats, actuator: str) -> Sent:
    """Frames of EcuStatus: the applied commands. spark: rad, shape (n,), one per throttle sample."""
    held = Authority.THROTTLE if actuator == "throttle" else Authority.SPARK
    return devices.message(
        "EcuStatus",
        "ecu",
        throttle.true,
        authority=np.full(spark.size, int(held)),
        throttle_command=throttle.value,
        spark_command=spark,
    )


def trial_frames(devices: Devices, seconds: float, begins: float, ends: float) -> list[Sent]:
    """Frames of TrialStatus and RiderControls. seconds: length; begins, ends: of the excitation, s."""
    status, hand = np.arange(0.003, seconds, 0.02), np.arange(0.002, seconds, 0.005)
    phase = np.where(status < begins, int(Phase.ARMED), int(Phase.EXCITING))
    phase = np.where(status >= ends, int(Phase.SETTLING), phase)
    return [
        devices.unstamped(
            "TrialStatus", status, phase=phase, tick=np.round(status * 1e3).astype(int)
        ),
        devices.unstamped(
            "RiderControls",
            hand,
            button=(hand > begins - 0.05).astype(int),
            grip=np.full(hand.size, 0.08),
        ),
    ]


def repeated(sent: Sent, line: Line, rng: np.random.Generator) -> Sent:
    """Frames of a message with those that are sent twice, in the order in which they are ready.

    A frame is repeated before its sender sends the next one of that message.
    """
    again = np.flatnonzero(rng.uniform(size=sent.ready.size) < line.repeated)
    if again.size == 0:
        return sent
    gap = np.diff(sent.ready, append=sent.ready[-1] + AGAIN)[again]
    later = sent.ready[again] + np.minimum(rng.exponential(AGAIN, again.size), 0.5 * gap)
    ready = np.concatenate((sent.ready, later))
    order = np.argsort(ready, kind="stable")
    return Sent(sent.name, ready[order], np.concatenate((sent.data, sent.data[again]))[order])


def recorded(log: FrameLog, line: Line, rng: np.random.Generator) -> FrameLog:
    """Frames that the logger keeps: it loses bursts of random length at random times."""
    begins = np.flatnonzero(rng.uniform(size=log.time_ns.size) < line.lost / BURST)
    ends = np.minimum(begins + rng.geometric(1.0 / BURST, begins.size), log.time_ns.size)
    change = np.zeros(log.time_ns.size + 1, np.int64)
    np.add.at(change, begins, 1)
    np.add.at(change, ends, -1)
    return log.select(np.flatnonzero(np.cumsum(change[:-1]) == 0))


def on_the_bus(database: Database, sent: list[Sent]) -> FrameLog:
    """All frames in the order of their arrival, after arbitration."""
    ready = np.concatenate([s.ready for s in sent])
    order = np.argsort(ready, kind="stable")
    identifiers = np.concatenate(
        [np.full(s.ready.size, database.message(s.name).identifier, np.uint32) for s in sent]
    )[order]
    lengths = np.concatenate([np.full(s.ready.size, s.data.shape[1], np.uint8) for s in sent])
    data = np.concatenate([np.pad(s.data, ((0, 0), (0, 8 - s.data.shape[1]))) for s in sent])
    n = ready.size
    none = np.zeros(n, np.bool_)
    log = FrameLog(
        np.asarray(ready[order] * 1e9, np.int64),
        np.zeros(n, np.uint8),
        identifiers,
        none,
        none,
        none,
        lengths[order],
        data[order],
        (BUS,),
    )
    wire = np.asarray(frame_bits(log).nominal / BITRATE * 1e9, np.int64)
    ends = arrivals(log.time_ns, log.identifier.astype(np.int64), wire)
    arrived = FrameLog(
        START + ends,
        *(
            getattr(log, f)
            for f in ("bus", "identifier", "extended", "fd", "sent", "length", "data", "buses")
        ),
    )
    return arrived.select(np.argsort(ends, kind="stable"))


def candump_text(log: FrameLog) -> str:
    """A log as text, as `candump -L -x` writes it."""
    seconds, rest = np.divmod(log.time_ns, 1_000_000_000)
    payload = log.data.tobytes().hex().upper()
    return "".join(
        f"({s:010d}.{us:06d}) {BUS} {i:03X}#{payload[16 * k : 16 * k + 2 * n]} R\n"
        for k, (s, us, i, n) in enumerate(
            zip(
                seconds.tolist(),
                (rest // 1000).tolist(),
                log.identifier.tolist(),
                log.length.tolist(),
                strict=True,
            )
        )
    )
