"""Keys that control a replay from its terminal."""

import os
import re
import select
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from slipbench.bench.replay.replay_controls import Controls

HELP = (
    "space: pause, left and right: 10 s back and forward, - and +: half and double speed, q: stop"
)
JUMP = 10_000_000_000  # ns
KEY = re.compile(r"\x1b\[[A-D]|.", re.DOTALL)
MOST = 1024  # bytes of keys in one read


def steer(controls: Controls, key: str) -> None:
    """Apply a key to the controls; other keys have no effect."""
    if key == " ":
        (controls.resume if controls.paused else controls.pause)()
    elif key in ("\x1b[C", "\x1b[D"):
        controls.seek(controls.position + (JUMP if key.endswith("C") else -JUMP))
    elif key in ("+", "-"):
        controls.set_speed(controls.speed * (2.0 if key == "+" else 0.5))
    elif key == "q":
        controls.stop()


@contextmanager
def keys() -> Iterator[bool]:
    """Whether single keys can be read, without the return key; False without a terminal."""
    if not sys.stdin.isatty():
        yield False
        return
    import termios
    import tty

    before = termios.tcgetattr(sys.stdin)
    tty.setcbreak(sys.stdin)
    try:
        yield True
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


def pressed() -> list[str]:
    """Keys that were pressed since the last call, arrows as their escape sequences.

    It bypasses Python's own buffer and reads only what is available, so that Escape alone is a key.
    """
    number = sys.stdin.fileno()
    if not select.select([number], [], [], 0)[0]:
        return []
    return KEY.findall(os.read(number, MOST).decode("ascii", "replace"))
