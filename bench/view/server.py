"""Web server of the view: one page, one WebSocket, and one thing that a page can do: trip."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from slipbench.bench.view.access import Access, Right
from slipbench.bench.view.sources import LiveSource, ReplaySource
from slipbench.protocol.extras import optional_library

if TYPE_CHECKING:
    from starlette.applications import Starlette
    from starlette.requests import HTTPConnection, Request
    from starlette.responses import Response
    from starlette.websockets import WebSocket

POLICY = 1008  # close code of a refusal
PAGE = files("slipbench.bench.view") / "page"
SHARED = files("slipbench") / "static"
NAMES = {
    "index.html": PAGE,
    "view.css": PAGE,
    "view.js": PAGE,
    "uplot.iife.min.js": SHARED,
    "uplot.min.css": SHARED,
}
HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'self'; connect-src 'self' ws:; img-src data:; "
    "frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
Trip = Callable[[], bool]


class Pages:
    """Answers to the requests of pages."""

    def __init__(
        self, source: LiveSource | ReplaySource, access: Access, cookie: str, trip: Trip | None
    ) -> None:
        """See `application`."""
        self._source, self._access, self._cookie, self._trip = source, access, cookie, trip
        self._answers: Any = optional_library("starlette.responses")
        self._closed: Any = optional_library("starlette.websockets").WebSocketDisconnect

    async def page(self, request: "Request") -> "Response":
        """The page or one of its files. A token in the address becomes a cookie."""
        if self._right(request) is Right.NONE:
            return self._refused(
                "the view needs the address that the bench printed, with its token"
            )
        token = request.query_params.get("token")
        if token and not self._access.open_to_all:
            moved: Response = self._answers.RedirectResponse("/", 303, HEADERS)
            moved.set_cookie(self._cookie, token, httponly=True, samesite="strict")
            return moved
        name = request.path_params.get("name", "index.html")
        if name not in NAMES:
            return self._said({"error": "no such file"}, 404)
        file: Response = self._answers.FileResponse(str(NAMES[name] / name), headers=HEADERS)
        return file

    async def trip(self, request: "Request") -> "Response":
        """End the trial, where this viewer may. A body is not read."""
        if self._right(request) is not Right.TRIP or request.headers.get("origin") is None:
            return self._refused("this viewer may not trip")
        if self._trip is None or not self._trip():
            return self._said({"error": "no trial runs"}, 409)
        return self._said({"tripped": True}, 200)

    async def live(self, socket: "WebSocket") -> None:
        """Updates until the page disconnects."""
        right = self._right(socket)
        if right is Right.NONE:
            await socket.close(POLICY)  # before it is accepted: HTTP 403
            return
        await socket.accept()
        with suppress(self._closed, RuntimeError):  # RuntimeError: it closed meanwhile
            await self._source.stream(socket.send_text, socket.receive_text, right)

    def _right(self, request: "HTTPConnection") -> Right:
        if not self._access.same_site(request.headers):
            return Right.NONE
        token = request.query_params.get("token")
        return self._access.right(token, request.cookies.get(self._cookie))

    def _refused(self, why: str) -> "Response":
        return self._said({"error": why}, 403)

    def _said(self, what: dict[str, Any], status: int) -> "Response":
        answer: Response = self._answers.JSONResponse(what, status, HEADERS)
        return answer


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
        routing.Route("/", pages.page),
        routing.Route("/{name}", pages.page),
        routing.Route("/trip", pages.trip, methods=["POST"]),
        routing.WebSocketRoute("/live", pages.live),
    ]
    made: Starlette = applications.Starlette(routes=routes, lifespan=lifespan)
    return made
