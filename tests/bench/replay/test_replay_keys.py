"""Keys of a terminal: each is read once, in order, without waiting."""

import os
import pty
import sys
import time
from collections.abc import Callable, Iterator

import pytest

from slipbench.bench.replay.replay_controls import FASTEST, Controls
from slipbench.bench.replay.replay_keys import keys, pressed, steer

WITHIN = 5.0  # s that a loaded machine may take to hand a key over


@pytest.fixture
def typed(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[bytes], None]]:
    """A terminal on which a test types."""
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "r") as terminal:
        monkeypatch.setattr(sys, "stdin", terminal)
        with keys() as listening:
            assert listening
            yield lambda text: os.write(ours, text) and None
    os.close(ours)


def all_pressed(count: int) -> list[str]:
    """The next `count` keys."""
    found: list[str] = []
    deadline = time.monotonic() + WITHIN
    while len(found) < count and time.monotonic() < deadline:
        found += pressed()
    return found


def test_nothing_pressed_is_nothing_waited_for(typed: Callable[[bytes], None]) -> None:
    assert pressed() == []


def test_escape_alone_is_a_key_and_does_not_block(typed: Callable[[bytes], None]) -> None:
    """A replay that waits for the rest of an escape sequence would not react to Ctrl-C either."""
    typed(b"\x1b")
    assert all_pressed(1) == ["\x1b"]
    typed(b" ")
    assert all_pressed(1) == [" "]


def test_keys_that_come_at_once_all_count(typed: Callable[[bytes], None]) -> None:
    typed(b"++\x1b[C\x1b[D q")
    assert all_pressed(6) == ["+", "+", "\x1b[C", "\x1b[D", " ", "q"]


def test_other_keys_have_no_effect(typed: Callable[[bytes], None]) -> None:
    controls = Controls.local()
    typed("\u00e9\x1bOx".encode())
    for key in all_pressed(4):
        steer(controls, key)
    assert controls.changes == 0


def test_a_key_that_is_held_down_stays_within_what_the_controls_hold() -> None:
    controls = Controls.local()
    for _ in range(100):
        steer(controls, "+")
    assert controls.speed == FASTEST
    for _ in range(100):
        steer(controls, "-")
    assert controls.speed > 0
