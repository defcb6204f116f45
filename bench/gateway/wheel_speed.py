"""Tooth intervals from sampled wheel speeds: for a motorcycle that sends no tooth times."""

from slipbench.protocol.codec.messages import Intervals, ToothIntervals

SLOWEST = 0.1  # m/s: below it a wheel stands


class WheelSpeedTeeth:
    """Teeth of an imaginary encoder that turns with the sampled speed of one wheel.

    Between two samples the wheel turns with the speed of the second one. Every interval gives that
    speed exactly, and the teeth keep pace with the distance.
    """

    def __init__(self, pitch: float) -> None:
        """pitch: m of tread per tooth."""
        self._pitch = pitch
        self._time: float | None = None
        self._phase = 0.0  # of a tooth, passed since the last one
        self._count = 0

    def take(self, speed: float, now: float) -> ToothIntervals:
        """Teeth up to a sample. speed: m/s, that arrived at `now` (s)."""
        elapsed = 0.0 if self._time is None else max(now - self._time, 0.0)
        self._time = now
        if speed < SLOWEST:
            self._phase = 0.0
            return ToothIntervals(Intervals.STANDING, self._count, (self._pitch / SLOWEST,))
        interval = self._pitch / speed
        self._phase += elapsed / interval
        passed = int(self._phase)
        self._phase -= passed
        if passed == 0:
            return ToothIntervals(Intervals.STANDING, self._count, (interval,))
        self._count += passed
        return ToothIntervals(Intervals.SHORT, self._count, (interval,) * passed)
