"""Streams to the clients of a server: of what is recorded now, or of a replay that they control."""

import math
import threading
from collections.abc import Callable
from typing import Any

from slipbench.bench.foxglove.publisher import Publisher
from slipbench.bench.foxglove.server import ReplayState, Server
from slipbench.bench.loop.clock import SECOND, Clock
from slipbench.bench.view.live_run import LiveView
from slipbench.bench.view.replay_run import ReplayRun
from slipbench.bench.view.sources import PERIOD

SETTLING = (
    SECOND // 2
)  # ns that clients have to subscribe: after new topics, or the last of several
NOTHING_SKIPPED = math.inf  # bytes that the stream may lag behind the recorder
LAGS = "the stream lags behind the recording: what is shown is late; nothing is skipped"
Wait = Callable[[float], bool]


class LiveStream:
    """Stream of the newest run below a folder. It may lag behind the recorder, but skips no frame."""

    def __init__(self, server: Server, view: LiveView, clock: Clock) -> None:
        """Read by `view`, which must not skip."""
        self._server, self._view, self._clock = server, view, clock
        self._publisher, self._due, self._lags = Publisher(server), 0, False

    @property
    def waits_for_clients(self) -> bool:
        """Whether topics are new, so that clients still subscribe to them."""
        return self._clock.now_ns() < self._due

    @property
    def complete(self) -> bool:
        """Whether all frames that were recorded by now were sent."""
        return not self.waits_for_clients and self._view.complete

    def step(self) -> None:
        """Send what is new. The frames of a run wait until clients can subscribe to its topics."""
        if self.waits_for_clients:
            return
        began, portion = self._view.read()
        if began and self._view.recorded is not None:
            self._publisher.begin(self._view.recorded)
            self._due = self._clock.now_ns() + SETTLING
        if portion is not None:
            self._publisher.publish(portion)
            self._warn_of_lag()

    def _warn_of_lag(self) -> None:
        """Warn all clients for as long as more is recorded than a look reads."""
        lags = self._view.behind > 0
        if lags and not self._lags:
            self._server.warn(LAGS)
        elif self._lags and not lags:
            self._server.withdraw(LAGS)
        self._lags = lags


class ReplayStream:
    """Replay with one clock for all clients: it plays while a client has subscribed to a topic."""

    def __init__(self, server: Server, run: ReplayRun, clock: Clock) -> None:
        """Wait at the first frame."""
        self._server, self._run, self._clock = server, run, clock
        self._lock = threading.Lock()  # requests come in threads of the server
        self._publisher = Publisher(server)
        self._publisher.begin(run.recorded)
        self._run.control({"play": False, "seek": 0.0})
        self._watched, self._resume, self._ended = False, True, False
        self._count, self._changed = 0, 0
        server.subscriptions.answer = self.answer

    def step(self) -> None:
        """Send what is due. Without a client nothing is read, so that the next one misses nothing."""
        with self._lock:
            self._start_or_pause()
            if not self._watched:
                return
            ended = self._run.ended
            self._publisher.publish(self._run.read())
            if ended and not self._ended:
                self._server.report(self._state())
            self._ended = ended

    def answer(self, request: Any) -> Any:
        """Play, pause, seek, or another speed, as a client requests. Returns the state of the replay."""
        wish = {"play": self._server.plays(request), "speed": request.playback_speed}
        if request.seek_time is not None:
            wish["seek"] = (request.seek_time - self._run.bounds[0]) / SECOND
        with self._lock:
            self._watched = True
            return self._server.playback_state(self._control(wish), request.request_id)

    def _start_or_pause(self) -> None:
        """Play when clients have subscribed, from the first frame after an end; pause without any."""
        now, count = self._clock.now_ns(), self._server.subscriptions.count
        if count != self._count:
            self._count, self._changed = count, now
        if not self._server.subscribed:
            if self._watched:
                self._resume = self._run.playing or self._run.ended
                self._server.report(self._control({"play": False}))
            self._watched = False
        elif not self._watched and now - self._changed >= SETTLING:
            self._watched = True
            restart = {"seek": 0.0} if self._run.ended else {}
            self._server.report(self._control({"play": self._resume, **restart}))

    def _control(self, wish: dict[str, Any]) -> ReplayState:
        """Control the replay. Returns its state."""
        seek = self._run.control(wish)
        if seek:
            self._publisher.time, self._ended = 0, False
        return self._state(seek)

    def _state(self, seek: bool = False) -> ReplayState:
        run = self._run
        status = "Ended" if run.ended else "Playing" if run.playing else "Paused"
        time_ns = run.begin if seek else run.bounds[0] + run.position
        return ReplayState(status, time_ns, run.speed, seek)


def run_stream(
    step: Callable[[], None], warn: Callable[[str], None], clock: Clock, ends: Wait
) -> None:
    """Take a step every `PERIOD` until `ends` returns True; a delayed step is not made up for.

    ends  waits for a time (s), and returns whether to end
    warn  receives what cannot be read; the trial and its recording do not depend on it
    """
    due, warned = clock.now_ns(), ""
    while not ends(max(0.0, (due - clock.now_ns()) / SECOND)):
        try:
            step()
        except Exception as fault:
            if warned != (warned := f"the stream cannot read: {fault}"):
                warn(warned)
        due = max(due + round(PERIOD * SECOND), clock.now_ns())
