"""Files that somebody damaged, or made to do harm: what is read from them is data, no more."""

import contextlib
from collections.abc import Callable
from pathlib import Path

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from slipbench.protocol.errors import InputError

NASTY = [
    b"\0",
    b"\xff\xfe",
    b"\n" * 50,
    b"[" * 3000,
    b"{" * 3000,
    b'"',
    b"'''",
    b"-1",
    b"1e999",
    b"nan",
    b"99999999999999999999999999",
    b"../../etc/passwd",
    b"\xef\xbb\xbf",
    b"#",
    b"=",
    b",",
    b"%s%n",
    b"__import__('os')",
    b"(0.0) can0 1FFFFFFFF#00\n",
    b"\r",
    b";",
    b"inf",
    b"0x",
    b"4294967296",
]

fuzz = settings(
    deadline=None,
    database=None,
    derandomize=True,
    suppress_health_check=list(HealthCheck),
    report_multiple_bugs=False,
)


@st.composite
def damaged(draw: st.DrawFn, whole: bytes) -> bytes:
    """The bytes of a good file, with up to five places cut, flipped, repeated or overwritten."""
    data = bytearray(whole)
    for _ in range(draw(st.integers(1, 5))):
        at = draw(st.integers(0, max(len(data) - 1, 0)))
        length = draw(st.integers(0, 40))
        match draw(st.sampled_from(["flip", "cut", "cut off", "insert", "repeat", "overwrite"])):
            case "flip" if data:
                data[at] ^= 1 << draw(st.integers(0, 7))
            case "cut":
                del data[at : at + length]
            case "cut off":
                del data[at:]
            case "insert":
                data[at:at] = draw(st.sampled_from(NASTY))
            case "repeat":
                data[at:at] = data[at : at + length] * draw(st.integers(1, 20))
            case _:
                data[at : at + length] = draw(st.binary(max_size=40))
    return bytes(data)


def survives(read: Callable[[Path], object], path: Path, data: bytes) -> None:
    """Read a file made of `data`: it works, or it is the user's to mend; nothing else."""
    path.write_bytes(data)
    with contextlib.suppress(InputError):
        read(path)
