"""Laws of `slipbench bind`: from a database and a capture to a file that binds, and never over another."""

import sys
from pathlib import Path

import numpy as np
import pytest

from slipbench import command
from slipbench.protocol.binding.binding import read_binding
from slipbench.protocol.codec.protection import Bits as BitsOf
from slipbench.protocol.codec.protection import Guard, Plain, Profile1, guard_of
from slipbench.protocol.database.layout import Checksum, Message

DBC = """VERSION ""
BS_:
BU_: ECU
BO_ 288 EngineData: 8 ECU
 SG_ EngineRPM : 16|16@1+ (0.25,0) [0|16000] "rpm" ECU
 SG_ GearPos : 32|4@1+ (1,0) [0|6] "" ECU
 SG_ ThrottlePos : 40|8@1+ (0.5,0) [0|100] "%" ECU
BO_ 304 WheelData: 8 ECU
 SG_ FrontWheelSpeed : 0|16@1+ (0.01,0) [0|400] "km/h" ECU
 SG_ RearWheelSpeed : 16|16@1+ (0.01,0) [0|400] "km/h" ECU
 SG_ AliveCounter : 48|4@1+ (1,0) [0|15] "" ECU
 SG_ Checksum : 56|8@1+ (1,0) [0|255] "" ECU
"""
GEARS = (420.0, 300.0, 230.0)  # rpm for each m/s
SEED = 11


def drive(folder: Path) -> None:
    """A capture of 60 s at 50 Hz: both wheels, an engine with three gears, and two kinds of protection."""
    print(f"seed {SEED}")
    random = np.random.default_rng(SEED)
    engine: Guard = Profile1(0x0155)
    wheels: Guard = Plain(BitsOf(48, 15, False), 16, 7, Checksum("", "crc8", 0x2F, 0xFF, 0xFF))
    lines = []
    for number in range(3000):
        time = number * 0.02
        speed = 20.0 + 12.0 * np.sin(time / 5.0)
        gear = min(int(speed // 11), 2)
        rpm = speed * GEARS[gear] + random.normal(0, 5)
        payload = bytearray(8)
        payload[2:4] = int(rpm * 4).to_bytes(2, "little")
        payload[4], payload[5] = gear + 1, int(40 + 30 * np.sin(time))
        engine.protect(payload, number % 15)
        other = bytearray(8)
        other[0:2] = int(speed * 360).to_bytes(2, "little")
        other[2:4] = int((speed * 1.02 + random.normal(0, 0.05)) * 360).to_bytes(2, "little")
        wheels.protect(other, number % 16)
        lines += [f"({time:.6f}) can0 120#{payload.hex()}", f"({time:.6f}) can0 130#{other.hex()}"]
    (folder / "drive.log").write_text("\n".join(lines) + "\n")
    (folder / "bike.dbc").write_text(DBC)


@pytest.fixture
def bind_in(tmp_path, monkeypatch, capsys):
    drive(tmp_path)
    capsys.readouterr()

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "argv", ["slipbench", "bind", *arguments])
        with pytest.raises(SystemExit) as end:
            command.main()
        printed = capsys.readouterr()
        return end.value.code, printed.out, printed.err

    return run


def guarded(message: Message) -> Guard:
    guard = guard_of(message)
    assert guard is not None
    return guard


def test_a_capture_gives_cycle_times_protections_and_roles(bind_in, tmp_path) -> None:
    status, out, err = bind_in("bike.dbc", "--log", "drive.log", "--out", "new/bike.toml")
    assert status == 0, err
    assert "EngineData.EngineRPM" in out
    text = (tmp_path / "new/bike.toml").read_text()
    binding = read_binding(
        tmp_path / "new/bike.toml"
    )  # the database is found from the file's folder
    engine, wheels = (binding.database.message(name) for name in ("EngineData", "WheelData"))
    assert engine.cycle_time == pytest.approx(0.02, rel=1e-3)
    assert isinstance(guarded(engine), Profile1)
    assert wheels.protection is not None
    assert wheels.protection.counter == "AliveCounter"
    assert wheels.protection.checksum == Checksum("Checksum", "crc8", 0x2F, 0xFF, 0xFF)
    assert "gear ratios" in text
    assert "explains" in text
    assert binding.roles is not None
    assert {"engine_speed", "gear", "rear_wheel_speed"} <= set(binding.roles.roles)


def test_a_capture_finds_engine_gear_and_speed_without_their_names(bind_in, tmp_path) -> None:
    text = DBC
    for number, name in enumerate(
        ("EngineRPM", "GearPos", "ThrottlePos", "FrontWheelSpeed", "RearWheelSpeed")
    ):
        text = text.replace(name, f"Sig{number:02d}Q")
    text = text.replace("EngineData", "Kalo").replace("WheelData", "Miru")
    (tmp_path / "hidden.dbc").write_text(text)
    status, _, err = bind_in("hidden.dbc", "--log", "drive.log", "--out", "hidden.toml")
    assert status == 0, err
    binding = read_binding(tmp_path / "hidden.toml")
    assert binding.roles is not None
    bound = {role: source.signals[0] for role, source in binding.roles.roles.items()}
    assert bound["engine_speed"] == "Kalo.Sig00Q"
    assert bound["gear"] == "Kalo.Sig01Q"
    assert bound["vehicle_speed"].startswith("Miru.")
    assert "by behaviour alone" in (tmp_path / "hidden.toml").read_text()


def test_the_database_alone_gives_the_roles(bind_in, tmp_path) -> None:
    status, _, err = bind_in("bike.dbc", "--out", "bike.toml", "--title", "Bike")
    assert status == 0, err
    roles = read_binding(tmp_path / "bike.toml").roles
    assert roles is not None
    assert roles.title == "Bike"
    assert roles.roles["front_wheel_speed"].signals == ("WheelData.FrontWheelSpeed",)
    assert not roles.messages


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("bike.dbc", "--out", "drive.log"), "exists"),
        (("no.dbc", "--out", "x.toml"), "no.dbc"),
        (("bike.dbc", "--log", "no.log", "--out", "x.toml"), "no.log"),
        (("bike.dbc", "--log", "other.log", "--out", "x.toml"), "0x7ff"),
    ],
)
def test_what_cannot_be_used_is_one_message_and_no_file(bind_in, tmp_path, arguments, word) -> None:
    (tmp_path / "other.log").write_text("(0.000000) can0 7FF#00\n(0.100000) can0 7FF#01\n")
    status, out, err = bind_in(*arguments)
    assert (status, out) == (2, "")
    assert word in err
    assert not (tmp_path / "x.toml").exists()
