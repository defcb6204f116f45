"""What is wrong with an input is one readable message, whatever the input was."""

import errno
import os
import re
import sys
from io import BytesIO, TextIOWrapper
from pathlib import Path
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from slipbench import command
from slipbench.identification.fleet import fleet
from slipbench.identification.mismatch import explain
from slipbench.identification.mismatch.systems.model_file import load_model_file
from slipbench.identification.report.operation import late_ticks
from slipbench.plant.blocks import Encoder
from slipbench.plant.errors import ParameterError, VehicleFileError
from slipbench.plant.vehicle_file import load_vehicle
from slipbench.protocol.configuration import load_toml, parse, read_toml
from slipbench.protocol.controller_file import ControllerFile
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.run_folder import DESCRIPTION, write_description
from tests.identification.mismatch.spring import MODEL
from tests.paths import CONTROLLERS, DEMONSTRATION


@pytest.mark.parametrize("teeth", [float("nan"), float("inf"), -float("inf"), 10**400, 16.5, True])
def test_encoder_teeth_are_a_finite_whole_number(teeth):
    with pytest.raises(ParameterError, match="a whole number from"):
        Encoder(teeth=teeth)


@pytest.mark.parametrize("value", ["nan", "inf", "1" + "0" * 400, "1e999", "true", '"16"', "[16]"])
@pytest.mark.parametrize("key", ["value", "plus_minus"])
def test_every_number_of_a_vehicle_file_is_finite(tmp_path, key, value):
    other = "plus_minus" if key == "value" else "value"
    entry = f'teeth = {{ {other} = 16, {key} = {value}, unit = "1" }}'
    text = DEMONSTRATION.read_text().replace('teeth = { value = 16, unit = "1" }', entry, 1)
    (tmp_path / "vehicle.toml").write_text(text)
    with pytest.raises(VehicleFileError, match=r"rear_encoder\.teeth"):
        load_vehicle(tmp_path / "vehicle.toml")


@pytest.mark.parametrize(
    ("block", "entry", "most"),
    [
        (
            "body",
            'mass = { value = 245, unit = "kg", plus_minus = 1e300 }',
            r"at most 2\.45e\+03 kg",
        ),
        ("engine", 'peak_speed = { value = 9000, unit = "rpm", plus_minus = 1e5 }', "9e.04 rpm"),
        ("tyre", 'form_1 = { value = 0.01, unit = "1", plus_minus = 1e300 }', r"0\.6 1, the width"),
    ],
)
def test_a_half_width_of_a_vehicle_file_has_a_bound(tmp_path, block, entry, most):
    (tmp_path / "vehicle.toml").write_text(f"[{block}]\n{entry}\n")
    with pytest.raises(VehicleFileError, match=most) as refused:
        load_vehicle(tmp_path / "vehicle.toml")
    assert f"{block}.{entry.split()[0]}.plus_minus" in str(refused.value)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("plus_minus = 20 }", "plus_minus = 1e300 }", "1e.300 N/kg/V is too large"),
        ("plus_minus = 20 }", "plus_minus = 1001 }", "gain: plus_minus.*10 times the value"),
        ('along = "velocity"', 'along = "velocit"', "seams.*along = 'velocit' does not exist"),
        ('into = "position"', 'into = "place"', "overflows_into = 'place' does not exist"),
        ("[states.velocity]", '[states.velocity]\nstart = "no"', "start = 'no' does not exist"),
        ("value = 100,", "value = 1e300,", "1e.300 N/kg/V is too large"),
        ("size = { value = 1,", "size = { value = 1e-300,", "1e-300 .* is no size"),
        ("size = { value = 1,", "size = { value = 0,", "0 .* is no size"),
    ],
)
def test_a_number_of_a_model_file_has_a_bound(tmp_path, old, new, expected):
    (tmp_path / "model.toml").write_text(MODEL.replace(old, new, 1))
    with pytest.raises(InputError, match=expected):
        load_model_file(tmp_path / "model.toml")


@pytest.mark.parametrize(
    "text", ["a = " + "[" * 3000, "a = " + "{a=" * 3000, "[[effects]]\nname = []"]
)
def test_a_vehicle_file_that_is_none_is_refused(tmp_path, text):
    (tmp_path / "vehicle.toml").write_text(text)
    with pytest.raises(VehicleFileError):
        load_vehicle(tmp_path / "vehicle.toml")


def test_a_message_has_no_control_characters_and_an_end():
    message = str(InputError("x" * 9000, where="a\0b\x1b[2J", found="y" * 9000, remedy="é °\nnext"))
    assert len(message) < 4000
    assert all(c.isprintable() or c == "\n" for c in message)
    assert "a\\x00b\\x1b[2J" in message
    assert "remedy: é °\nnext" in message


@pytest.mark.parametrize(
    ("key", "value", "expected"),
    [
        ("inverse", [[1.0, 0.0, 0.0, -2e9, 0.8]], "a1 = -2e.09, a2 = 0.8 is unstable"),
        ("inverse", [[1.0, 0.0, 0.0, -1.0, 0.0]], "is unstable"),  # an integrator
        ("model", [[0.0, 1.0, 0.0, 0.0, -1.0]], "is unstable"),
        ("inverse", [[1e300, 0.0, 0.0, 0.0, 0.0]], "1000000000000"),
    ],
)
def test_a_controller_whose_state_would_grow_is_refused(key, value, expected):
    tree = read_toml(CONTROLLERS / "throttle.toml", ControllerFile).model_dump()
    tree["law"][key] = value
    with pytest.raises(InputError, match=expected):
        parse(tree, ControllerFile, "controller.toml")


@pytest.mark.parametrize(
    ("table", "key", "value"),
    [
        ("mixed", "exchange", 0.0),
        ("mixed", "exchange", 1e-300),
        ("mixed", "delay", 2**31),
        ("governor", "gain", 0.0),
        ("law", "delay", 2**31),
        ("law", "model", ()),
        ("law", "model", [[1.0, 0.0, 0.0, 0.0, 0.0]]),
        ("law", "inverse", [[1.0, 0.0, 0.0, 0.0, 0.0]] * 51),
        (None, "period", 0.0),
        (None, "period", 1e-300),
        (None, "period", 60.0),
    ],
)
def test_a_controller_that_cannot_be_made_is_refused(table, key, value):
    tree = read_toml(CONTROLLERS / "mixed.toml", ControllerFile).model_dump()
    (tree[table] if table else tree)[key] = value
    with pytest.raises(InputError, match=key if key != "model" else "law"):
        parse(tree, ControllerFile, "controller.toml")


def interrupted_in_compiled_code(*_, **__):
    """Raise what numba raises when Ctrl-C comes while it loads code for a call into compiled code."""
    loaded = SystemError("_numba_unpickle returned a result with an exception set")
    loaded.__cause__ = KeyboardInterrupt()
    raise SystemError("returned a result with an exception set") from loaded


def test_ctrl_c_in_compiled_code_ends_a_command_as_everywhere(monkeypatch, capsys):
    monkeypatch.setattr(command, "app", interrupted_in_compiled_code)
    with pytest.raises(SystemExit) as end:
        command.main()
    assert end.value.code == 130
    assert capsys.readouterr().err == "Aborted!\n"


def test_ctrl_c_in_compiled_code_keeps_what_explain_has(monkeypatch):
    monkeypatch.setattr(explain, "analyse", interrupted_in_compiled_code)
    so_far = SimpleNamespace(done=1, complete=False, failure="")
    assert explain.run_analysis(so_far) is False
    assert so_far.failure == ""


def test_another_system_error_is_none_of_the_users(monkeypatch):
    def broken():
        raise SystemError("broken")

    monkeypatch.setattr(command, "app", broken)
    with pytest.raises(SystemError):
        command.main()


def test_what_the_system_refuses_is_a_message(monkeypatch, capsys):
    monkeypatch.setattr(command, "app", lambda: Path("\x1b" * 300).stat())
    with pytest.raises(SystemExit) as end:
        command.main()
    assert end.value.code == 2
    said = capsys.readouterr().err
    assert re.fullmatch(r"slipbench: (\\x1b)+\.\.\. .*: File name too long\n", said)


def test_a_fault_of_ours_is_no_message(monkeypatch):
    def broken():
        raise OSError(errno.EBADF, "Bad file descriptor")

    monkeypatch.setattr(command, "app", broken)
    with pytest.raises(OSError, match="Bad file descriptor"):
        command.main()


def test_a_value_that_a_list_lacks_is_named():
    """The place of a missing value lies beyond the end of what the file has."""
    with pytest.raises(InputError, match="prefilter"):
        parse({"prefilter": [[1.0, 2.0]]}, ControllerFile, "controller.toml")


def test_a_fleet_with_an_analysis_that_could_not_be_done_is_no_success(tmp_path, monkeypatch):
    entry = '[[analyses]]\nname = "first"\nvehicle = "missing.toml"\ntraining = ["missing"]\n'
    (tmp_path / "fleet.toml").write_text(entry)
    rows = [{"name": "first", "trouble": "no such file"}]
    monkeypatch.setattr(fleet, "explain_fleet", lambda *_: rows)
    line = ["explain-fleet", str(tmp_path / "fleet.toml"), "--out", str(tmp_path / "out")]
    end = CliRunner().invoke(command.app, line)
    assert end.exit_code == 3
    assert "first: no such file" in end.output


def test_a_path_that_is_no_text_is_printed(monkeypatch):
    written = BytesIO()
    monkeypatch.setattr(sys, "stdout", TextIOWrapper(written, encoding="ascii"))
    monkeypatch.setattr(command, "app", lambda: print(os.fsdecode(b"out\xff"), "90 °"))
    command.main()
    sys.stdout.flush()
    assert written.getvalue() == b"out\\udcff 90 \\xb0\n"


@pytest.mark.parametrize(
    "ticks", [b"lateness_ns\n" + b"9" * 200_000, b"lateness_ns\nx", b"lateness_ns\n\xff"]
)
def test_a_damaged_file_of_tick_lateness_is_named(tmp_path, ticks):
    (tmp_path / "ticks.csv").write_bytes(ticks)
    with pytest.raises(InputError, match=r"ticks\.csv: the file of tick lateness is damaged"):
        late_ticks(SimpleNamespace(folder=tmp_path))


def test_a_recording_may_have_a_name_that_is_no_text(tmp_path):
    write_description(tmp_path, {"run": {"name": os.fsdecode(b"out\xff")}})
    assert load_toml(tmp_path / DESCRIPTION) == {"run": {"name": "out?"}}
