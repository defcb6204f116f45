"""Keys that steer a replay from the terminal it was started on."""

import os
import re
import select
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from slipbench.bench.replay.replay_controls import Controls

HELP = "space: pause, left and right: 10 s, - and +: half and twice as fast, q: stop"
JUMP = 10_000_000_000  # ns
KEY = re.compile(r"\x1b\[[A-D]|.", re.DOTALL)
MOST = 1024  # bytes of keys at a look


def steer(controls: Controls, key: str) -> None:
    """Do what `key` asks for."""
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
    """Have single keys come without the return key; False where there is no terminal to do so."""
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
    """Give the keys that were pressed since the last look, arrows as their escape sequences.

    Read past Python's own buffer, and only what is there: Escape alone is a key and no beginning.
    """
    number = sys.stdin.fileno()
    if not select.select([number], [], [], 0)[0]:
        return []
    return KEY.findall(os.read(number, MOST).decode("ascii", "replace"))
