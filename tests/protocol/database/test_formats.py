"""One database in each format that cantools reads means the same."""

from dataclasses import fields

import cantools.database
import pytest
from hypothesis import given

from slipbench.dbc import MOTORBIKE
from slipbench.protocol.database.database import describe, load_database
from slipbench.protocol.database.layout import Database, Signal
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.database_copy import copy_database, find_database
from slipbench.protocol.recording.import_log import Capture, import_capture
from tests.hostile.damage import damaged, fuzz, survives
from tests.protocol.database.arxml import arxml_of

# Signal names that occur once: the writer of SYM merges signals of one name.
DBC = """VERSION ""

BU_: Ecu

BO_ 291 Engine: 8 Ecu
 SG_ RPM : 0|16@1+ (0.25,0) [0|16000] "rpm" Vector__XXX
 SG_ Torque : 23|12@0- (0.5,-100) [-1000|1000] "Nm" Vector__XXX
 SG_ Gear : 32|4@1+ (1,0) [0|15] "" Vector__XXX

BO_ 2566844672 Wheels: 4 Ecu
 SG_ Rear : 0|16@1+ (0.01,0) [0|655] "m/s" Vector__XXX
 SG_ Front : 16|16@1+ (0.01,0) [0|655] "m/s" Vector__XXX
"""
MEANING = ("name", "start", "length", "little_endian", "signed", "is_float", "unit")


def written(form):
    """The database above in another format, by cantools, or by our own writer for ARXML."""
    if form == "dbc":
        return DBC
    if form == "arxml":
        return arxml_of(described(DBC))
    parsed = cantools.database.load_string(DBC, "dbc")
    return parsed.as_kcd_string() if form == "kcd" else parsed.as_sym_string()


def described(text):
    """The text of a DBC as frozen data."""
    messages = cantools.database.load_string(text, "dbc").messages
    return Database("x", "", tuple(describe(message) for message in messages), ())


def meaning(database):
    return {
        message.name: (
            message.identifier,
            message.extended,
            message.length,
            sorted(
                (*(getattr(signal, name) for name in MEANING), *map(float, scaling(signal)))
                for signal in message.signals
            ),
        )
        for message in database.messages
    }


def scaling(signal):
    return signal.scale, signal.offset


@pytest.mark.parametrize("form", ["arxml", "kcd", "sym"])
@pytest.mark.parametrize("ending", ["dbc", "txt"])
def test_every_format_means_the_same_whatever_its_name(tmp_path, form, ending):
    (tmp_path / "x.dbc").write_text(DBC)
    path = tmp_path / f"y.{ending}"
    path.write_text(written(form), encoding="utf-8")
    assert meaning(load_database(path)) == meaning(load_database(tmp_path / "x.dbc"))


def test_a_kcd_file_of_the_motorcycle_has_every_signal(tmp_path):
    path = tmp_path / "x.kcd"
    path.write_text(cantools.database.load_file(MOTORBIKE).as_kcd_string())
    same = [f.name for f in fields(Signal) if f.name in {*MEANING, "scale", "choices"}]
    for message, other in zip(
        sorted(load_database(MOTORBIKE).messages, key=lambda m: m.name),
        sorted(load_database(path).messages, key=lambda m: m.name),
        strict=True,
    ):
        for name, signal in message.by_name.items():
            again = other.by_name[name]
            assert [getattr(signal, key) for key in same] == [getattr(again, key) for key in same]


@pytest.mark.parametrize("form", ["arxml", "kcd", "sym"])
def test_a_capture_is_imported_with_it(tmp_path, form):
    (tmp_path / "x.db").write_text(written(form), encoding="utf-8")
    (tmp_path / "x.log").write_text("(1.0) can0 123#A00F000000000000\n(1.1) can0 123#A00F0000\n")
    (tmp_path / "roles.toml").write_text(
        'title = "t"\n[roles.engine_speed]\nsignals = ["Engine.RPM"]\nunit = "rpm"\n'
    )
    capture = Capture(tmp_path / "x.log", tmp_path / "roles.toml", tmp_path / "x.db")
    found = import_capture(capture, tmp_path / "run").channels["engine_speed"].value
    assert found == pytest.approx([1000 * 2 * 3.141592653589793 / 60])


@pytest.mark.parametrize("form", ["dbc", "arxml", "kcd", "sym"])
def test_a_run_folder_keeps_the_database_under_the_ending_of_its_format(tmp_path, form):
    """Other tools choose their parser by the ending; the name of the original says nothing."""
    (tmp_path / "x.db").write_text(written(form), encoding="utf-8")
    copy = copy_database(tmp_path / "x.db", tmp_path)
    assert copy.name == f"database.{form}"
    assert find_database(tmp_path) == copy
    assert cantools.database.load_file(copy, strict=False).messages


def test_the_database_of_a_run_folder_is_found_under_any_ending(tmp_path):
    assert find_database(tmp_path).name == "database.dbc"  # which a message then reports missing
    (tmp_path / "database.dbc").write_text(written("kcd"), encoding="utf-8")
    assert meaning(load_database(find_database(tmp_path))) == meaning(described(DBC))
    (tmp_path / "database.sym").write_text(written("sym"), encoding="utf-8")
    with pytest.raises(InputError, match="one database"):
        find_database(tmp_path)


@pytest.mark.parametrize("form", ["arxml", "kcd", "sym"])
def test_a_damaged_database_is_read_or_refused(tmp_path, form):
    @fuzz
    @given(damaged(written(form).encode()))
    def attempt(data):
        survives(load_database, tmp_path / "x", data)

    attempt()


@pytest.mark.parametrize("text", ["<?xml version='1.0'?><x/>", "<AUTOSAR>", "FormatVersion=6.0\n"])
def test_what_is_no_database_is_refused(tmp_path, text):
    (tmp_path / "x").write_text(text)
    with pytest.raises(InputError, match="not a usable"):
        load_database(tmp_path / "x")
