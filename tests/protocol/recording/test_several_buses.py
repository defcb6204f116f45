"""Messages on the bus that a role map names for them: in a database, a log and an import."""

import numpy as np
import pytest

from slipbench import dbc
from slipbench.protocol.binding.binding import read_binding
from slipbench.protocol.configuration import read_toml
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.export import export_run
from slipbench.protocol.logs.candump import parse_pieces
from slipbench.protocol.logs.decode import sort_log
from slipbench.protocol.recording.import_log import Capture, import_capture
from slipbench.protocol.recording.role_map import RoleMap
from tests.protocol.binding.foreign import foreign

KCD = """<NetworkDefinition xmlns="http://kayak.2codeornot2code.org/1.0">
<Document/>
<Bus name="p"><Message id="0x10" length="2" name="Engine"><Signal name="rpm" offset="0" length="16">
<Value unit="rpm"/></Signal></Message></Bus>
<Bus name="c"><Message id="0x10" length="1" name="Gear"><Signal name="gear" offset="0" length="8"/>
</Message></Bus>
</NetworkDefinition>
"""
DBC = """VERSION ""
BU_: A
BO_ 16 Engine: 2 A
 SG_ rpm : 0|16@1+ (1,0) [0|65535] "rpm" Vector__XXX
BO_ 16 Gear: 1 A
 SG_ gear : 0|8@1+ (1,0) [0|255] "" Vector__XXX
"""
ROLES = """title = "one identifier, two meanings"
bus = "powertrain"
[messages.Gear]
bus = "chassis"
[roles.engine_speed]
signals = ["Engine.rpm"]
[roles.gear]
signals = ["Gear.gear"]
"""
LOG = "".join(
    f"(100.{tick:06d}) {bus} 010#{data} R\n"
    for tick in range(0, 1_000_000, 50_000)
    for bus, data in (("powertrain", f"{tick // 1000:04X}"), ("chassis", "03"))
)


@pytest.fixture
def files(tmp_path):
    for name, text in (("x.kcd", KCD), ("x.dbc", DBC), ("x.toml", ROLES), ("x.log", LOG)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def imported(files, log="x.log", roles="x.toml"):
    capture = Capture(files / log, files / roles, files / "x.kcd", {})
    return import_capture(capture, files / "run")


def test_one_identifier_on_two_buses_is_two_messages(files):
    found = imported(files)
    assert found.missing == {}
    np.testing.assert_array_equal(found.channels["gear"].value, 3)
    rpm = np.array([int.from_bytes((k * 50).to_bytes(2, "big"), "little") for k in range(20)])
    np.testing.assert_allclose(found.channels["engine_speed"].value, rpm * 2 * np.pi / 60)
    assert found.channels["gear"].origin == "chassis Gear.gear"
    assert export_run(files / "run", "parquet").samples == 40


def test_a_bus_that_the_log_does_not_have_leaves_its_roles_without_samples(files):
    (files / "x.log").write_text(LOG.replace("chassis", "can7"))
    found = imported(files)
    assert "gear" not in found.channels
    assert "chassis; the log has" in found.missing["gear"]
    assert "can7" in found.missing["gear"]


@pytest.mark.parametrize("roles", [ROLES, ROLES.replace('bus = "powertrain"\n', "")])
@pytest.mark.parametrize("form", ["kcd", "dbc"])
def test_a_doubled_identifier_is_refused_unless_each_has_a_bus_of_its_own(files, form, roles):
    """In a DBC file always: its attributes name a message by its identifier."""
    (files / "x.toml").write_text(roles)
    bus_of = read_toml(files / "x.toml", RoleMap).bus_of
    if form == "kcd" and "powertrain" in roles:
        assert len(load_database(files / "x.kcd", bus_of).messages) == 2
        return
    with pytest.raises(InputError, match="share identifier 0x10"):
        load_database(files / f"x.{form}", bus_of)


def test_frames_of_buses_that_were_read_in_turn_are_sorted_without_a_warning():
    def warned(*stamps):
        text = "".join(f"({t:.6f}) {bus} 010#00 R\n" for t, bus in stamps)
        warnings = []
        log = parse_pieces([text.encode()], "x.log", warnings)
        assert (np.diff(log.time_ns) >= 0).all()
        return bool(warnings)

    assert not warned((1.0, "a"), (1.002, "a"), (1.001, "b"), (1.003, "b"))
    assert warned((1.0, "a"), (1.002, "a"), (1.001, "a"))
    assert warned((1.0, "a"), (1.102, "a"), (1.001, "b"))


def test_a_message_without_a_bus_is_decoded_on_every_one():
    frame = "(1.0) can0 010#0000000000000000 R\n(1.1) can1 010#0000000000000000 R\n"
    log = parse_pieces([frame.encode()], "x.log", [])
    own = load_database(dbc.MOTORBIKE)
    command = own.message("ActuatorCommand")
    assert command.identifier == 0x10
    assert len(sort_log(log, own).frames["ActuatorCommand"]) == 2
    there = own.on_buses(lambda name: "can1" if name == "ActuatorCommand" else "")
    assert list(sort_log(log, there).frames["ActuatorCommand"].rows) == [1]


BUSES = ("powertrain", "chassis")


def test_a_message_with_a_role_and_without_a_bus_beside_others_is_refused(tmp_path):
    made = foreign(2, BUSES)
    del made.binding["bus"]
    with pytest.raises(InputError, match="no bus is named for") as refused:
        read_binding(made.write(tmp_path))
    assert "buses chassis" in str(refused.value)
    assert 'bus = "chassis"' in str(refused.value)


def test_a_role_on_another_bus_than_its_message_is_refused(tmp_path):
    made = foreign(2, BUSES)
    for source in made.binding["roles"].values():
        source["bus"] = "can9"
    with pytest.raises(InputError, match="are on different buses") as refused:
        read_binding(made.write(tmp_path))
    assert "'can9'" in str(refused.value)


@pytest.mark.parametrize("name", ["a b", "chassis=can1", "x" * 16])
def test_a_name_that_no_record_can_hold_is_refused(name, tmp_path):
    made = foreign(2, BUSES)
    made.binding["bus"] = name
    with pytest.raises(InputError, match="bus"):
        read_binding(made.write(tmp_path))
