"""Web server of the view: one page, one WebSocket, and one thing that a page can do: trip."""

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager, suppress
from importlib.resources import files
from typing import Any, Protocol

from starlette.applications import Starlette
from starlette.requests import HTTPConnection, Request
from starlette.responses import FileResponse, JSONResponse, RedirectResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from slipbench.bench.view.access import Access, Right
from slipbench.bench.view.live_run import LiveView
from slipbench.bench.view.message import to_json
from slipbench.bench.view.replay_run import ReplayRun

PERIOD = 0.025  # s between two updates
WAITING = 8  # updates that wait for a slow page; older ones are dropped
POLICY, LARGEST_MESSAGE = 1008, 1000  # close code of a refusal; characters
PAGE = files("slipbench.bench.view") / "page"
NAMES = ("index.html", "view.css", "view.js", "uPlot.iife.min.js", "uPlot.min.css")
HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'self'; connect-src 'self' ws:; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
Trip = Callable[[], bool]


class Source(Protocol):
    """Where updates come from: run folders that grow, or a recording."""

    async def stream(self, send: Callable[[str], Any], socket: WebSocket, right: Right) -> None:
        """Send messages to one page until it disconnects."""


class LiveSource:
    """One reader of the run that is recorded now, for all pages."""

    def __init__(self, view: LiveView) -> None:
        """Read by `view`, once `feed` runs."""
        self._view = view
        self._pages: set[asyncio.Queue[str]] = set()
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
    def complete(self) -> bool:
        """Whether the newest run has ended and has its quick look."""
        return self._view.complete

    async def feed(self) -> None:
        """Read and send every `PERIOD`, for ever; a reader that was held up does not catch up.

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

    async def stream(self, send: Callable[[str], Any], socket: WebSocket, right: Right) -> None:
        """Send the run so far, then each update, until the page disconnects."""
        queue: asyncio.Queue[str] = asyncio.Queue(WAITING)
        hello = {"type": "hello", "right": right.value, "live": True, **self._view.hello()}
        await send(to_json(hello))
        self._pages.add(queue)
        try:
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

    async def stream(self, send: Callable[[str], Any], socket: WebSocket, right: Right) -> None:
        """Send the replay, and let the page play, pause and seek, until it disconnects."""
        run, wishes = self._open(), asyncio.Queue[str]()

        async def hello() -> None:
            await send(to_json({"type": "hello", "right": "replay", "live": False, **run.hello()}))

        async def listen() -> None:
            while True:
                await wishes.put(await socket.receive_text())

        listening = asyncio.create_task(listen())
        try:
            await hello()
            while not listening.done():
                while not wishes.empty():
                    if run.control(_wish(wishes.get_nowait())):
                        await hello()
                await send(to_json({"type": "update", **run.update()}))
                await asyncio.sleep(PERIOD)
        finally:
            listening.cancel()
            with suppress(asyncio.CancelledError, WebSocketDisconnect):
                await listening
            run.close()


def _wish(text: str) -> Mapping[str, Any]:
    """What a page of a replay asks for; empty where it is nothing known."""
    try:
        wish = json.loads(text[:LARGEST_MESSAGE])
    except ValueError:
        return {}
    return wish if isinstance(wish, dict) else {}


def application(
    source: LiveSource | ReplaySource, access: Access, cookie: str, trip: Trip | None = None
) -> Starlette:
    """The web application. trip: ends the trial, and says whether one ran; None: nothing to trip."""

    def right_of(request: HTTPConnection) -> Right:
        if not access.same_site(request.headers):
            return Right.NONE
        return access.right(request.query_params.get("token"), request.cookies.get(cookie))

    async def page(request: Request) -> Response:
        if right_of(request) is Right.NONE:
            return _refused("the view needs the address that the bench printed, with its token")
        token = request.query_params.get("token")
        if token and not access.open_to_all:
            moved = RedirectResponse("/", 303, HEADERS)
            moved.set_cookie(cookie, token, httponly=True, samesite="strict")
            return moved
        name = request.path_params.get("name", "index.html")
        if name not in NAMES:
            return JSONResponse({"error": "no such file"}, 404)
        return FileResponse(str(PAGE / name), headers=HEADERS)

    async def stop(request: Request) -> Response:
        if right_of(request) is not Right.TRIP or request.headers.get("origin") is None:
            return _refused("this viewer may not trip")
        if trip is None or not trip():
            return JSONResponse({"error": "no trial runs"}, 409)
        return JSONResponse({"tripped": True})

    async def socket(connection: WebSocket) -> None:
        right = right_of(connection)
        if right is Right.NONE:
            await connection.close(POLICY)  # before it is accepted: HTTP 403
            return
        await connection.accept()
        with suppress(WebSocketDisconnect, RuntimeError):  # RuntimeError: it closed meanwhile
            await source.stream(connection.send_text, connection, right)

    @asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        if isinstance(source, ReplaySource):
            yield
            return
        feeding = asyncio.create_task(source.feed())
        yield
        feeding.cancel()

    routes = [
        Route("/", page),
        Route("/{name}", page),
        Route("/trip", stop, methods=["POST"]),
        WebSocketRoute("/live", socket),
    ]
    return Starlette(routes=routes, lifespan=lifespan)


def _refused(why: str) -> Response:
    return JSONResponse({"error": why}, 403, HEADERS)
