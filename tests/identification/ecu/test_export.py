"""What is written, and what is refused before anything is written."""

from dataclasses import replace

import pytest
from typer.testing import CliRunner

from slipbench.command import app
from slipbench.identification.ecu import lua_script
from slipbench.identification.ecu.export import EcuRequest, law_of, write_export
from slipbench.identification.ecu.notes import loss_of_phase
from slipbench.protocol.errors import InputError
from tests.identification.ecu.conftest import SHIPPED
from tests.paths import CONTROLLERS


def request(tmp_path, name="throttle", **changed):
    base = EcuRequest(
        CONTROLLERS / f"{name}.toml", "rusefi", 0.03, 200.0, "subtracted", tmp_path / "out"
    )
    return replace(base, **changed)


@pytest.mark.parametrize("name", SHIPPED)
def test_script_table_and_notes_are_written(tmp_path, name):
    asked = request(tmp_path, name)
    files = write_export(law_of(asked), asked)
    assert [path.suffix for path in files] == [".lua", ".table", ".md"]
    assert all(path.stat().st_size for path in files)
    notes = files[-1].read_text()
    for lacking in ("Rate", "Delay", "Tooth-pitch", "Memory", "Governor and", "no dynamics"):
        assert lacking in notes


def test_without_a_sign_there_is_no_table(tmp_path):
    asked = request(tmp_path, table=None)
    assert [p.name for p in write_export(law_of(asked), asked)] == ["slip_control.lua", "README.md"]


def test_the_phase_that_the_tick_costs_is_that_of_the_longer_hold(tmp_path):
    law = law_of(request(tmp_path))
    expected = 360 * law.file.designed["bandwidth_hz"] * 0.002  # 5 ms and 1 ms, halves
    assert loss_of_phase(law) == pytest.approx(expected)
    assert loss_of_phase(replace(law, file=law.file.model_copy(update={"designed": {}}))) is None


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"unit": "speeduino"}, "Speeduino has no traction control"),
        ({"unit": "motec"}, "not known"),
        ({"target": 0.0}, "no slip to hold"),
        ({"target": 3.0}, "0.03 is 3 %"),
        ({"target": float("nan")}, "no slip to hold"),
        ({"tick_rate": 1000.0}, "1 to 200 Hz"),
        ({"tick_rate": 150.0}, "whole number"),
        ({"table": "positive"}, "added or subtracted"),
    ],
)
def test_what_cannot_be_exported_is_refused_and_nothing_written(tmp_path, changed, message):
    asked = request(tmp_path, **changed)
    with pytest.raises(InputError, match=message):
        write_export(law_of(asked), asked)
    assert not asked.out.exists()


def test_a_folder_that_is_there_is_not_overwritten(tmp_path):
    (tmp_path / "out").mkdir()
    with pytest.raises(InputError, match="there already"):
        law_of(request(tmp_path))


def test_a_controller_that_cannot_reduce_is_refused(tmp_path):
    text = (CONTROLLERS / "spark.toml").read_text()
    path = tmp_path / "up.toml"
    path.write_text(text.replace("low = -0.15707963267948966", "low = 0.0"))
    with pytest.raises(InputError, match="cannot reduce"):
        law_of(request(tmp_path, controller=path))


def test_a_script_that_is_too_large_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(lua_script, "SCRIPT_SIZE", 100)
    asked = request(tmp_path)
    with pytest.raises(InputError, match="larger than rusEFI takes"):
        write_export(law_of(asked), asked)
    assert not asked.out.exists()


def test_the_command_prints_what_it_wrote(tmp_path):
    out = tmp_path / "rusefi"
    arguments = [str(CONTROLLERS / "spark.toml"), "--for", "rusefi", "--target", "0.03"]
    done = CliRunner().invoke(app, ["export-controller", *arguments, "--out", str(out)])
    assert done.exit_code == 0, done.output
    assert done.output.split() == [str(out / "slip_control.lua"), str(out / "README.md")]
