"""A drive of a real car, put on a real CAN interface again."""

from pathlib import Path

import pytest

from tests.recordings import recording
from tests.socketcan.inside.programs import ON_THE_BUS, candump, frames, slipbench

FRAMES = 82_558


@pytest.fixture(scope="module")
def drive() -> Path:
    return recording("subaru_wrx/can_sample.log")


def test_an_independent_listener_gets_every_frame_in_order(tmp_path: Path, drive: Path) -> None:
    heard = tmp_path / "heard.log"
    with candump(heard):
        replay = slipbench("replay", drive, *ON_THE_BUS, "--speed", "20")
        said, _ = replay.communicate(timeout=120)
    assert replay.returncode == 0, said
    assert len(frames(heard)) == FRAMES
    assert frames(heard) == frames(drive)
