"""`explain` identifies known effects in published recordings, and no mismatch in controls."""

from dataclasses import replace
from pathlib import Path

import pytest

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.verdict import Verdict
from slipbench.identification.mismatch.simulation.piece import Piece
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.protocol.recording.import_log import Capture, import_capture
from tests.paths import MODELS, ROLES
from tests.recordings import recording

CLOCKS = ("clock_drift", "clock_offset", "sensor_delay")
FILTERS = ("lag", "delay", "elastic_transmission")


@pytest.fixture(scope="module")
def drive(tmp_path_factory) -> Path:
    """Import the Subaru's drive with its two loggers."""
    folder = recording("subaru_wrx")
    tables = {"accessport": folder / "accessport_sample.csv"}
    roles = ROLES / "subaru_wrx_two_loggers.toml"
    out = tmp_path_factory.mktemp("runs") / "wrx"
    capture = Capture(folder / "can_sample.log", roles, folder / "sample_can_spec.dbc", tables)
    import_capture(capture, out)
    return out


def model(name: str) -> ModelSystem:
    return ModelSystem.load(MODELS / f"{name}.toml")


def piece(system: ModelSystem, drive: Path, span: str, gains: float = 0.0) -> Record:
    """Make a piece ready. gains: what is added to the rate of the second logger's clock."""
    whole = Piece.of(drive.with_name(f"wrx@{span}")).read()
    logger = whole.channels["second_engine_speed"]
    logger = replace(logger, time=logger.time * (1.0 + gains))
    return system.prepare(
        replace(whole, channels={**whole.channels, "second_engine_speed": logger})
    )


def explained(system: ModelSystem, kinds: tuple[str, ...], *records: Record) -> Verdict:
    library = [k for k in system.library if k.name in kinds]
    return verdict(analyse(begin(system, records[:1], records[1:]), library))


def test_the_second_logger_is_laid_onto_the_bus_and_its_clock_keeps_time(drive: Path) -> None:
    loggers = model("two_loggers")
    record = piece(loggers, drive, "0:45")
    assert "59.93" in record.notes[0]
    assert "correlation with the simulation is 1.0000" in record.notes[0]
    assert not explained(loggers, CLOCKS, record).mismatch


def test_a_drift_of_15_ms_a_minute_put_into_the_second_logger_is_found(drive: Path) -> None:
    loggers = model("two_loggers")
    found = explained(loggers, CLOCKS, piece(loggers, drive, "0:45", gains=2.5e-4))
    assert [e.name for e in found.effects] == ["clock_drift"]
    rate = found.effects[0].parameters[0]
    assert rate.low < 2.5e-4 < rate.high


def test_the_told_speed_lags_the_wheels(drive: Path) -> None:
    speed = model("speed_of_the_wheels")
    found = explained(speed, FILTERS, piece(speed, drive, "0:45"))
    (effect,) = found.effects  # where noise of the wheels may be smoothed, both explain as much
    assert effect.name in ("lag", "delay")
    assert effect.parameters[0].value == pytest.approx(0.11, abs=0.02)


def test_two_front_wheels_on_a_straight_lack_nothing(drive: Path) -> None:
    wheels = model("left_and_right")
    pieces = [piece(wheels, drive, span) for span in ("50:70", "70:90")]
    assert not explained(wheels, (*FILTERS, "clock_drift"), *pieces).mismatch
