"""Web server of a page that shows tables: its files, and answers to what it asks for by name.

    serve_tables({"rows": rows}, "season", Address(), print)

An answer is a function of the parameters in the address, and gives what JSON can hold. Nothing can be
changed from the page.
"""

import threading
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from slipbench.bench.loop.interrupts import interrupts
from slipbench.bench.view.access import Access, Address, Right
from slipbench.bench.view.guard import CHARTS, PAGE, Guard
from slipbench.bench.view.web import listen, require_web, run_server, urls
from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library

if TYPE_CHECKING:
    from starlette.applications import Starlette
    from starlette.requests import Request
    from starlette.responses import Response

Answer = Callable[[Mapping[str, str]], Mapping[str, Any]]


def table_application(
    answers: Mapping[str, Answer], page: str, access: Access, cookie: str
) -> "Starlette":
    """The web application. page: name of its files, without the ending.

    An InputError of an answer becomes status 400 with its message. Raises InputError where the extra
    is missing.
    """
    routing, applications = map(optional_library, ("starlette.routing", "starlette.applications"))
    names = {name: PAGE / name for name in ("view.css", f"{page}.css", f"{page}.js")}
    guard = Guard(access, cookie, {**names, **CHARTS, "index.html": PAGE / f"{page}.html"})

    async def answer(request: "Request") -> "Response":
        if guard.right(request) is Right.NONE:
            return guard.refused("the view needs the address that was printed, with its token")
        name = request.path_params["name"]
        if name not in answers:
            return guard.said({"error": "no such answer"}, 404)
        try:
            return guard.said(answers[name](dict(request.query_params)), 200)
        except InputError as fault:
            return guard.said({"error": str(fault)}, 400)

    routes = [
        routing.Route("/", guard.page),
        routing.Route("/{name}", guard.page),
        routing.Route("/answers/{name}", answer),
    ]
    made: Starlette = applications.Starlette(routes=routes)
    return made


def serve_tables(
    answers: Mapping[str, Answer], page: str, address: Address, say: Callable[[str], None]
) -> None:
    """Serve a page until Ctrl-C. say: receives the line with its address.

    Raises InputError where the extra is missing, or the address cannot be used.
    """
    require_web()
    stop = threading.Event()
    with listen(address) as listening:
        port = listening.getsockname()[1]
        access = Access(open_to_all=address.loopback)
        app = table_application(answers, page, access, f"slipbench_{port}")
        with run_server(app, listening), interrupts(stop):
            say(urls(address, port, access)[-1])  # read-only: there is nothing to trip
            stop.wait()
