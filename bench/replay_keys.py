"""Keys that steer a replay from the terminal it was started on."""

import select
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from bench.replay_controls import Controls

HELP = "space: pause, left and right: 10 s, - and +: half and twice as fast, q: stop"
JUMP = 10_000_000_000  # ns


def steer(controls: Controls, key: str) -> None:
    """Do what `key` asks for."""
    if key == " ":
        (controls.go_on if controls.paused else controls.pause)()
    elif key in ("\x1b[C", "\x1b[D"):
        controls.seek(controls.place + (JUMP if key.endswith("C") else -JUMP))
    elif key in ("+", "-"):
        controls.go_at(controls.speed * (2.0 if key == "+" else 0.5))
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


def pressed() -> str:
    """Give the key that was pressed, arrows as their escape sequence; empty: none."""
    if not select.select([sys.stdin], [], [], 0)[0]:
        return ""
    key = sys.stdin.read(1)
    return key + sys.stdin.read(2) if key == "\x1b" else key
