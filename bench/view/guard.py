"""What every server of a view checks and sends: rights, refusals, and the files of its page."""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import TYPE_CHECKING, Any

from slipbench.bench.view.access import Access, Right
from slipbench.protocol.extras import optional_library

if TYPE_CHECKING:
    from starlette.requests import HTTPConnection, Request
    from starlette.responses import Response

PAGE = files("slipbench.bench.view") / "page"
SHARED = files("slipbench") / "static"
CHARTS = {name: SHARED / name for name in ("uplot.iife.min.js", "uplot.min.css")}
HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'self'; connect-src 'self' ws:; img-src data:; "
    "frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


@dataclass(frozen=True)
class Guard:
    """access: who may do what; cookie: its name, which holds the token of a viewer; names: files of
    the page, by the name that it asks for."""

    access: Access
    cookie: str
    names: Mapping[str, Traversable]

    def right(self, request: "HTTPConnection") -> Right:
        """What this viewer may do."""
        if not self.access.same_site(request.headers):
            return Right.NONE
        token = request.query_params.get("token")
        return self.access.right(token, request.cookies.get(self.cookie))

    def refused(self, why: str) -> "Response":
        """Refusal with its reason."""
        return self.said({"error": why}, 403)

    def said(self, what: Mapping[str, Any], status: int) -> "Response":
        """Answer as JSON."""
        response: Response = _responses().JSONResponse(what, status, HEADERS)
        return response

    async def page(self, request: "Request") -> "Response":
        """The page or one of its files. A token in the address becomes a cookie."""
        if self.right(request) is Right.NONE:
            return self.refused("the view needs the address that the bench printed, with its token")
        token = request.query_params.get("token")
        if token and not self.access.open_to_all:
            moved: Response = _responses().RedirectResponse("/", 303, HEADERS)
            moved.set_cookie(self.cookie, token, httponly=True, samesite="strict")
            return moved
        name = request.path_params.get("name", "index.html")
        if name not in self.names:
            return self.said({"error": "no such file"}, 404)
        file: Response = _responses().FileResponse(str(self.names[name]), headers=HEADERS)
        return file


def _responses() -> Any:
    return optional_library("starlette.responses")
