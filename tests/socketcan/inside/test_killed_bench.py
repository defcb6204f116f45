"""A bench that dies whole in the middle of a trial: the motorcycle notices, the record stays."""

import signal
import time
from dataclasses import dataclass
from pathlib import Path

import can
import pytest

from slipbench import dbc
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.messages import ActuatorCommand, Authority, EcuStatus, ThrottleStatus
from slipbench.protocol.database.database import load_database
from tests.socketcan.inside.programs import (
    ON_THE_BUS,
    candump,
    cut_power,
    frames,
    short_trial,
    slipbench,
    wait_for_listeners,
)

SILENCE = 0.020  # s, after which the devices take authority back
LATENESS = 0.030  # s that a tick of the virtual motorcycle may be late on a loaded machine


@dataclass(frozen=True)
class Killed:
    """What is left after `kill -9`."""

    frames_log: Path
    witness: Path
    vehicle_said: str


@pytest.fixture(scope="module")
def killed(tmp_path_factory: pytest.TempPathFactory) -> Killed:
    folder = tmp_path_factory.mktemp("killed")
    file, log = short_trial(folder), folder / "witness.log"
    with candump(log):
        vehicle = slipbench("vehicle", file, *ON_THE_BUS)
        wait_for_listeners(2)
        trial = slipbench("trial", file, *ON_THE_BUS, "--real-time", "--out", folder / "run")
        assert trial.stdout
        assert any("exciting" in line for line in trial.stdout), "it never came to exciting"
        time.sleep(0.5)
        cut_power(trial)
        time.sleep(0.3)
        vehicle.send_signal(signal.SIGINT)
        vehicle_said, _ = vehicle.communicate(timeout=10)
    return Killed(folder / "run" / "frames.log", log, vehicle_said)


def test_the_devices_take_authority_back_within_their_time(killed: Killed) -> None:
    codec = Codec(load_database(dbc.MOTORBIKE))
    last_command, held_until = 0.0, {EcuStatus: 0.0, ThrottleStatus: 0.0}
    for message in can.LogReader(killed.witness):
        decoded = codec.decode(message.arbitration_id, message.data)
        match decoded:
            case ActuatorCommand():
                last_command = message.timestamp
            case EcuStatus(authority=held) | ThrottleStatus(authority=held):
                if held != Authority.NONE:
                    held_until[type(decoded)] = message.timestamp
    for until in held_until.values():
        assert 0 < until - last_command < SILENCE + LATENESS
    assert "watchdog timeout at" in killed.vehicle_said


def test_the_record_has_all_but_the_last_50_ms(killed: Killed) -> None:
    record, witness = frames(killed.frames_log), frames(killed.witness)
    [start] = [n for n in range(len(witness)) if witness[n : n + 50] == record[:50]]
    assert record == witness[start : start + len(record)]
    times = [message.timestamp for message in can.LogReader(killed.witness)]
    command = command_identifier()
    commands = [n for n, frame in enumerate(witness) if frame.startswith(command)]
    assert times[commands[-1]] - times[start + len(record) - 1] < 0.050


def command_identifier() -> str:
    identifier, _ = Codec(load_database(dbc.MOTORBIKE)).encode(
        ActuatorCommand(Authority.NONE, 0.0, 0.0, 0.0)
    )
    return f"{identifier:03X}#"
