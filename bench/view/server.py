"""Web server of the view: one page, one WebSocket, and one thing that a page can do: trip."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING, Any

from slipbench.bench.view.access import Access, Right
from slipbench.bench.view.guard import CHARTS, PAGE, Guard
from slipbench.bench.view.sources import LiveSource, ReplaySource
from slipbench.protocol.extras import optional_library

if TYPE_CHECKING:
    from starlette.applications import Starlette
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.websockets import WebSocket

POLICY = 1008  # close code of a refusal
NAMES = {name: PAGE / name for name in ("index.html", "view.css", "view.js")} | CHARTS
Trip = Callable[[], bool]


class Pages:
    """Answers to the requests of pages."""

    def __init__(
        self, source: LiveSource | ReplaySource, access: Access, cookie: str, trip: Trip | None
    ) -> None:
        """See `application`."""
        self.guard = Guard(access, cookie, NAMES)
        self._source, self._trip = source, trip
        self._closed: Any = optional_library("starlette.websockets").WebSocketDisconnect

    async def trip(self, request: "Request") -> "Response":
        """End the trial, where this viewer may. A body is not read."""
        guard = self.guard
        if guard.right(request) is not Right.TRIP or request.headers.get("origin") is None:
            return guard.refused("this viewer may not trip")
        if self._trip is None or not self._trip():
            return guard.said({"error": "no trial runs"}, 409)
        return guard.said({"tripped": True}, 200)

    async def live(self, socket: "WebSocket") -> None:
        """Updates until the page disconnects."""
        right = self.guard.right(socket)
        if right is Right.NONE:
            await socket.close(POLICY)  # before it is accepted: HTTP 403
            return
        await socket.accept()
        with suppress(self._closed, RuntimeError):  # RuntimeError: it closed meanwhile
            await self._source.stream(socket.send_text, socket.receive_text, right)


def application(
    source: LiveSource | ReplaySource, access: Access, cookie: str, trip: Trip | None = None
) -> "Starlette":
    """The web application.

    cookie  its name, which holds the token of a viewer
    trip    ends the trial, and says whether one ran; None: there is nothing to trip

    Raises InputError where the extra is missing.
    """
    routing, applications = map(optional_library, ("starlette.routing", "starlette.applications"))
    pages = Pages(source, access, cookie, trip)

    @asynccontextmanager
    async def lifespan(_: object) -> AsyncIterator[None]:
        feeding = asyncio.create_task(source.feed())
        yield
        feeding.cancel()

    routes = [
        routing.Route("/", pages.guard.page),
        routing.Route("/{name}", pages.guard.page),
        routing.Route("/trip", pages.trip, methods=["POST"]),
        routing.WebSocketRoute("/live", pages.live),
    ]
    made: Starlette = applications.Starlette(routes=routes, lifespan=lifespan)
    return made
