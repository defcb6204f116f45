"""Slip control over real CAN sockets: the motorcycle is one program, bench and controller another.

The target steps once up and once down; the slip of either second is counted from teeth and optical
speed of the recording, by nothing that the controller runs. See test_trial.py for the kernel's own
time, in which this trial is ridden.
"""

import signal
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from slipbench.protocol.codec.messages import Phase
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.run_folder import read
from tests.socketcan.inside.programs import ON_THE_BUS, slip_trial, slipbench, wait_for_listeners

STEP = 0.002  # of slip, from the upper target to the lower
HALF = 1.0  # s of either target
SETTLED = 0.4  # s after a step
TEETH, CIRCUMFERENCE = 16, 2 * np.pi * 0.32  # of the demonstration motorcycle's rear wheel, m


@dataclass(frozen=True)
class Ridden:
    """What a trial left behind."""

    status: int
    said: str
    folder: Path
    vehicle_said: str


@pytest.fixture(scope="module")
def ridden(tmp_path_factory: pytest.TempPathFactory) -> Ridden:
    folder = tmp_path_factory.mktemp("slip")
    file = slip_trial(folder)
    vehicle = slipbench("vehicle", file, *ON_THE_BUS)
    wait_for_listeners(1)
    trial = slipbench("trial", file, *ON_THE_BUS, "--real-time", "--out", folder / "run")
    said, _ = trial.communicate(timeout=60)
    vehicle.send_signal(signal.SIGINT)
    vehicle_said, _ = vehicle.communicate(timeout=10)
    return Ridden(trial.returncode, said, folder / "run", vehicle_said)


@pytest.fixture(scope="module")
def recording(ridden: Ridden) -> Recording:
    return read(ridden.folder)


def test_the_trial_is_done_and_authority_is_the_riders_again(
    ridden: Ridden, recording: Recording
) -> None:
    assert ridden.status == 0, ridden.said
    assert "done" in ridden.said
    authority = recording.channels["authority"].value
    assert authority.max() > 0
    assert authority[-1] == 0
    assert "watchdog timeout" not in ridden.vehicle_said


def test_the_slip_steps_with_its_target(recording: Recording) -> None:
    phase = recording.channels["trial_phase"]
    begin = float(phase.time[phase.value == Phase.EXCITING][0])
    up, down = (
        _mean_slip(recording, begin + k * HALF + SETTLED, begin + (k + 1) * HALF) for k in (0, 1)
    )
    assert up - down == pytest.approx(STEP, rel=0.25)


def _mean_slip(recording: Recording, start: float, end: float) -> float:
    """Mean slip between two times (s) of arrival: whole turns over metres."""
    teeth, optical = recording.channels["rear_teeth"], recording.channels["optical_speed"]
    assert teeth.arrival is not None
    inside = teeth.time[(teeth.arrival > start) & (teeth.arrival <= end)]
    turns = (inside.size - 1) // TEETH
    wheel = turns / (inside[turns * TEETH] - inside[0])
    heard = optical.time if optical.arrival is None else optical.arrival
    speed = np.nanmean(optical.value[(heard > start) & (heard <= end)])
    return float(wheel * CIRCUMFERENCE / speed)
