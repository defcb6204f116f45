"""New frames of a recording, and the state of its trial after them: what live view and replay read."""

from dataclasses import dataclass

from slipbench.bench.view.observer import Observed
from slipbench.protocol.logs.frame_log import FrameLog


@dataclass(frozen=True)
class Portion:
    """Result of one look at a recording.

    log       the new frames; None: there is none
    seen      state after them
    samples   `SAMPLED`, SI units, shape (n, 7)
    lateness  ms, and counts of ticks: see TickWatch
    begin     ns; earlier frames were read for the state alone, after a seek
    """

    log: FrameLog | None
    seen: Observed
    samples: list[tuple[float, ...]]
    lateness: dict[str, float]
    begin: int = 0
