"""Who may open the view, and who may trip: by address, host name and token."""

import hmac
import ipaddress
import secrets
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from slipbench.protocol.errors import InputError

DEFAULT_HOST, DEFAULT_PORT = "127.0.0.1", 8470
LARGEST_PORT = 65535
TOKEN_BYTES = 24
LOOPBACK_NAMES = ("localhost", "127.0.0.1", "::1")


class Right(Enum):
    """What a viewer may do."""

    NONE = "none"
    READ = "read-only"
    TRIP = "trip"


@dataclass(frozen=True)
class Address:
    """Where the view listens. chosen: the user named the port, so that no other may be taken."""

    host: str = DEFAULT_HOST
    port: int = DEFAULT_PORT
    chosen: bool = False

    @property
    def loopback(self) -> bool:
        """Whether only this machine can reach it."""
        if self.host == "localhost":
            return True
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return False


def address_of(text: str) -> Address:
    """Address from HOST, HOST:PORT or [HOST]:PORT. Raises InputError."""
    host, colon, port = text.rpartition(":")
    if not colon or (text.count(":") > 1 and not text.startswith("[")):
        host, port = text, ""
    host = host.strip("[]") or DEFAULT_HOST
    if not port:
        return Address(host)
    if not port.isascii() or not port.isdigit() or int(port) > LARGEST_PORT:
        raise InputError(
            "this is no address of a view",
            found=text,
            expected=f"HOST:PORT with a port from 0 to {LARGEST_PORT}",
            remedy=f"for this machine only: {DEFAULT_HOST}:{DEFAULT_PORT}",
        )
    return Address(host, int(port), chosen=True)


def _token() -> str:
    return secrets.token_urlsafe(TOKEN_BYTES)


@dataclass(frozen=True)
class Access:
    """Rights by token; on the loopback address without tokens everybody may trip."""

    open_to_all: bool
    trip_token: str = field(default_factory=_token, repr=False)
    read_token: str = field(default_factory=_token, repr=False)

    def right(self, *tokens: str | None) -> Right:
        """Right of a viewer with the first of these tokens that is given."""
        if self.open_to_all:
            return Right.TRIP
        token = next((each for each in tokens if each), "").encode("utf-8", "replace")
        may_trip = hmac.compare_digest(token, self.trip_token.encode())
        may_read = hmac.compare_digest(token, self.read_token.encode())
        return Right.TRIP if may_trip else Right.READ if may_read else Right.NONE

    def same_site(self, headers: Mapping[str, str]) -> bool:
        """Whether a request comes from the view's own page and not from another web site.

        Another site can point its own name at this machine, so without tokens the name must be one of
        this machine.
        """
        host, origin = headers.get("host", ""), headers.get("origin")
        if self.open_to_all and _name(host) not in LOOPBACK_NAMES:
            return False
        return origin is None or origin == f"http://{host}"


def _name(host: str) -> str:
    """Host name of a Host header, without its port."""
    if host.startswith("["):
        return host[1:].partition("]")[0]
    return host.partition(":")[0]
