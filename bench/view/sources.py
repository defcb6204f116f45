"""Where the pages' updates come from: one reader of what is recorded now, or a replay for each page."""

import asyncio
import json
from collections.abc import Awaitable, Callable, Mapping
from typing import Any

from slipbench.bench.view.access import Right
from slipbench.bench.view.live_run import LiveView
from slipbench.bench.view.message import to_json
from slipbench.bench.view.replay_run import ReplayRun

PERIOD = 0.025  # s between two updates
WAITING = 8  # updates that wait for a slow page; older ones are dropped
LARGEST_MESSAGE = 1000  # characters
Send = Callable[[str], Awaitable[None]]
Receive = Callable[[], Awaitable[str]]


class LiveSource:
    """One reader of the run that is recorded now, for all pages."""

    def __init__(self, view: LiveView) -> None:
        """Read by `view`, once `feed` runs."""
        self._view = view
        self._pages: set[asyncio.Queue[str]] = set()
        self._complete = False
        self.updates = self.dropped = 0

    @property
    def watched(self) -> bool:
        """Whether a page is connected."""
        return bool(self._pages)

    @property
    def running(self) -> bool:
        """Whether a trial runs."""
        return self._view.running

    @property
    def up_to_date(self) -> bool:
        """Whether every page has the end of the newest run, with its quick look."""
        return self._complete and all(queue.empty() for queue in self._pages)

    async def feed(self) -> None:
        """Read and send every `PERIOD`, without end; a delayed reader does not catch up.

        What cannot be read is shown on the page; the trial and its recording do not depend on it.
        """
        clock = asyncio.get_running_loop()
        due = clock.time()
        while True:
            try:
                self.update()
            except Exception as fault:
                self._publish(to_json({"type": "error", "error": f"the view cannot read: {fault}"}))
            due = max(due + PERIOD, clock.time())
            await asyncio.sleep(due - clock.time())

    def update(self) -> None:
        """Read what is new and put it into the queue of each page."""
        began, state = self._view.update()
        self.updates += 1
        if began:
            self._publish(to_json({"type": "hello", **self._view.hello()}))
        self._publish(to_json({"type": "update", **state}))
        self._complete = bool(state.get("outcome") and state.get("look"))

    async def stream(self, send: Send, receive: Receive, right: Right) -> None:
        """Send the run so far, then each update, until the page disconnects. It never receives."""
        queue: asyncio.Queue[str] = asyncio.Queue(WAITING)
        hello = {"type": "hello", "right": right.value, "live": True, **self._view.hello()}
        self._pages.add(queue)
        try:
            await send(to_json(hello))
            while True:
                await send(await queue.get())
        finally:
            self._pages.discard(queue)

    def _publish(self, text: str) -> None:
        for queue in self._pages:
            if queue.full():
                queue.get_nowait()
                self.dropped += 1
            queue.put_nowait(text)


class ReplaySource:
    """A replay for each page, with a clock of its own."""

    def __init__(self, open_run: Callable[[], ReplayRun]) -> None:
        """Replay what `open_run` opens."""
        self._open = open_run

    async def feed(self) -> None:
        """Return at once: each page reads for itself."""

    async def stream(self, send: Send, receive: Receive, right: Right) -> None:
        """Send the replay, and let the page play, pause and seek, until it disconnects."""
        run = self._open()
        wishes: asyncio.Queue[str] = asyncio.Queue()

        async def listen() -> None:
            while True:
                await wishes.put(await receive())

        listening = asyncio.create_task(listen())
        try:
            await self._play(run, wishes, send, listening)
        finally:
            listening.cancel()
            await asyncio.gather(listening, return_exceptions=True)
            run.close()

    async def _play(
        self, run: ReplayRun, wishes: asyncio.Queue[str], send: Send, listening: asyncio.Task[None]
    ) -> None:
        hello = {"type": "hello", "right": "replay", "live": False}
        await send(to_json({**hello, **run.hello()}))
        while not listening.done():
            while not wishes.empty():
                if run.control(_wish(wishes.get_nowait())):
                    await send(to_json({**hello, **run.hello()}))
            await send(to_json({"type": "update", **run.update()}))
            await asyncio.sleep(PERIOD)


def _wish(text: str) -> Mapping[str, Any]:
    """Control request of a page of a replay; empty where it is no JSON object."""
    try:
        wish = json.loads(text[:LARGEST_MESSAGE])
    except ValueError:
        return {}
    return wish if isinstance(wish, dict) else {}
