"""A database without something that gateway or motorcycle need is refused before a folder exists."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from unittest import mock

import pytest

from slipbench import dbc
from slipbench.bench.trials.preparation import prepare
from slipbench.bench.trials.run import run_trial
from slipbench.bench.vehicle.virtual_motorcycle import read_vehicle
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.configuration import load_toml
from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Database, Message, Signal
from slipbench.protocol.errors import InputError
from tests.paths import DEMONSTRATION, TRIALS

COMPLETE = load_database(dbc.MOTORBIKE)


def with_message(name: str, *instead: Message) -> Database:
    messages = [[each] if each.name != name else instead for each in COMPLETE.messages]
    return replace(COMPLETE, messages=tuple(each for some in messages for each in some))


def with_signal(message: str, name: str, *instead: Signal) -> Database:
    old = COMPLETE.message(message)
    signals = [[each] if each.name != name else instead for each in old.signals]
    new = replace(old, signals=tuple(each for some in signals for each in some))
    return with_message(message, new)


def changed(message: str, name: str, **changes: object) -> Database:
    signal = COMPLETE.message(message).signal(name)
    return with_signal(message, name, replace(signal, **changes))


def incomplete() -> Iterator[tuple[str, Database]]:
    """Every message and every signal deleted, then renamed, one at a time."""
    for message in COMPLETE.messages:
        renamed = replace(message, name=f"{message.name}2")
        yield f"{message.name} deleted", with_message(message.name)
        yield f"{message.name} renamed", with_message(message.name, renamed)
        for signal in message.signals:
            where = f"{message.name}.{signal.name}"
            other = replace(signal, name=f"{signal.name}_x")
            yield f"{where} deleted", with_signal(message.name, signal.name)
            yield f"{where} renamed", with_signal(message.name, signal.name, other)


@pytest.fixture
def trial(tmp_path: Path) -> Path:
    """The shortest trial: 100 ms at the operating point, 200 ms of excitation."""
    text = (TRIALS / "throttle_sweep.toml").read_text()
    vehicle = "../../plant/vehicles/demonstration.toml"
    assert vehicle in text
    lines = text.replace(vehicle, str(DEMONSTRATION)).splitlines()
    short = {"duration": '"200 ms"', "steady_for": '"100 ms"', "presses_button_after": '"200 ms"'}
    for key, value in short.items():
        lines = [f"{key} = {value}" if line.startswith(f"{key} =") else line for line in lines]
    lines = ['settling = "100 ms"', 'hand_back = "100 ms"', *lines]
    path = tmp_path / "trial.toml"
    path.write_text("\n".join(lines))
    return path


def test_a_database_that_lacks_something_is_refused_before_a_folder_exists_or_the_trial_completes(
    trial: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refused = accepted = completed = 0
    vehicle = read_vehicle(DEMONSTRATION)  # once: it takes longer than the checks
    monkeypatch.setattr("slipbench.bench.trials.preparation.read_vehicle", lambda _: vehicle)
    for what, database in incomplete():
        folder = tmp_path / what
        with mock.patch("slipbench.bench.trials.preparation.load_database", return_value=database):
            try:
                prepared = prepare(trial, dbc.MOTORBIKE)
                if what.endswith("renamed"):  # see the next test
                    accepted += 1
                    continue
                outcome = run_trial(prepared, folder, None)
            except InputError:
                assert not folder.exists(), what
                refused += 1
                continue
        assert outcome.done, f"{what}: {outcome.trip}"
        assert not outcome.notes, f"{what}: {outcome.notes}"
        completed += 1
    # The names of intervals are free, and one of several intervals of a layout may be absent.
    assert (refused, accepted, completed) == (168, 14, 10)


def test_a_trial_completes_whatever_the_intervals_are_called(trial: Path, tmp_path: Path) -> None:
    database = COMPLETE
    for name in ("RearTeeth", "FrontTeeth"):
        message = database.message(name)
        signals = tuple(
            replace(each, name=f"{each.name}_x") if each.multiplexer else each
            for each in message.signals
        )
        renamed = replace(message, signals=signals)
        messages = tuple(renamed if each is message else each for each in database.messages)
        database = replace(database, messages=messages)
    with mock.patch("slipbench.bench.trials.preparation.load_database", return_value=database):
        outcome = run_trial(prepare(trial, dbc.MOTORBIKE), tmp_path / "run", None)
    assert outcome.done, outcome.trip


@pytest.mark.parametrize(
    ("what", "database"),
    [
        ("no trip reason above 25", changed("TrialStatus", "trip", maximum=25)),
        ("a truth value of two bits", changed("RiderControls", "button", length=2, maximum=3)),
        ("no authority over both", changed("ActuatorCommand", "authority", maximum=2)),
        ("no throttle of 0", changed("ActuatorCommand", "throttle", minimum=0.5)),
        (
            "a 29-bit identifier",
            with_message("EcuStatus", replace(COMPLETE.message("EcuStatus"), extended=True)),
        ),
    ],
)
def test_a_database_that_cannot_carry_what_is_sent_is_refused(
    trial: Path, what: str, database: Database
) -> None:
    with (
        mock.patch("slipbench.bench.trials.preparation.load_database", return_value=database),
        pytest.raises(InputError),
    ):
        prepare(trial, dbc.MOTORBIKE)


def test_a_signal_with_a_negative_scale_keeps_its_range() -> None:
    signal = COMPLETE.message("Temperatures").signal("coolant")
    codec = Codec(with_signal("Temperatures", signal.name, replace(signal, scale=-0.1, offset=200)))
    frame = codec.encode(codec.decode(0x200, bytes(6)))  # type: ignore[arg-type]
    assert frame == (0x200, bytes(6))


def test_an_exception_in_a_trial_leaves_an_outcome_in_the_record(
    trial: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    with (
        mock.patch(
            "slipbench.bench.trials.simulated_trial.Recorder.drain", side_effect=ZeroDivisionError
        ),
        pytest.raises(ZeroDivisionError),
    ):
        run_trial(prepare(trial, dbc.MOTORBIKE), folder, None)
    outcome = load_toml(folder / "run.toml")["outcome"]
    assert not outcome["valid"]
    assert "ZeroDivisionError" in outcome["detail"]
