"""A table whose titles state units is a recording as it stands; what it lacks is said by column."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.import_log import Capture, import_capture
from slipbench.protocol.recording.run_folder import read
from slipbench.protocol.recording.table_recording import read_recording
from slipbench.protocol.units import linear

pa = pytest.importorskip("pyarrow")
TITLES = ["time [s]", "motor speed [rpm]", "torque [Nm]", "state [1]"]
ROLES = """
title = "test"
[quantities]
"motor speed" = "rad/s"
torque = "N m"
state = "1"
[roles."motor speed"]
column = "motor speed"
[roles.torque]
column = "torque"
[roles.state]
column = "state"
"""


def written(path, rows, titles=TITLES, delimiter=",", decimal="."):
    lines = [delimiter.join(titles)]
    lines += [delimiter.join(f"{x:.9g}".replace(".", decimal) for x in row) for row in rows]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def rows(count=40, start=5.0):
    time = start + 0.02 * np.arange(count)
    return np.column_stack((time, 600 * np.sin(time), 2 * np.cos(time), np.round(time) % 2))


@given(start=st.floats(0.0, 1e5), delimiter=st.sampled_from([";", "\t"]), comma=st.booleans())
def test_a_table_is_the_recording_that_an_import_with_roles_makes(
    tmp_path_factory, start, delimiter, comma
):
    folder = tmp_path_factory.mktemp("table")
    path = written(folder / "a.csv", rows(start=start), TITLES, delimiter, "," if comma else ".")
    (folder / "roles.toml").write_text(ROLES)
    whole = import_capture(Capture(path, folder / "roles.toml", None, {}), folder / "run")
    found = read_recording(path)
    assert found.channels.keys() == whole.channels.keys()
    for role, channel in whole.channels.items():
        assert linear(found.channels[role].unit, channel.unit) == (1.0, 0.0)
        assert np.allclose(found.channels[role].value, channel.value, rtol=1e-12, atol=1e-12)
        assert np.allclose(found.channels[role].time, channel.time, atol=1e-6)
    assert found.duration == pytest.approx(whole.duration, abs=1e-6)


def test_values_are_in_si_and_times_begin_at_zero(tmp_path):
    found = read_recording(written(tmp_path / "a.csv", rows()))
    assert found.channels["motor speed"].value == pytest.approx(rows()[:, 1] * np.pi / 30, rel=1e-7)
    assert found.channels["torque"].time[0] == 0.0
    assert "time" not in found.channels


def test_a_run_folder_is_read_as_before(tmp_path):
    path = written(tmp_path / "a.csv", rows())
    (tmp_path / "roles.toml").write_text(ROLES)
    import_capture(Capture(path, tmp_path / "roles.toml", None, {}), tmp_path / "run")
    assert (
        read_recording(tmp_path / "run").channels.keys() == read(tmp_path / "run").channels.keys()
    )


def test_parquet_without_units_says_what_is_missing(tmp_path):
    path = tmp_path / "a.parquet"
    columns = {"time": [0.0, 0.1, 0.2], "speed": [1.0, 2.0, 3.0]}
    pytest.importorskip("pyarrow.parquet").write_table(pa.table(columns), path)
    with pytest.raises(InputError, match="no column can be used") as refused:
        read_recording(path)
    assert "speed: no unit is stated" in str(refused.value)


def test_a_column_without_unit_or_with_text_is_missing_and_says_why(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time [s],speed [rad/s],gear,mode [1]\n0,1,2,on\n0.1,2,2,off\n0.2,3,2,on\n")
    found = read_recording(path)
    assert list(found.channels) == ["speed"]
    assert "no unit is stated" in found.missing["gear"]
    assert '"gear [1]"' in found.missing["gear"]
    assert "mode" in found.missing


@pytest.mark.parametrize("text", ['name = "a"\n', "(1.0) can0 123#00\n", "\x00\x01\x02"])
def test_what_is_neither_a_folder_nor_a_table_is_refused(tmp_path, text):
    path = tmp_path / "file.txt"
    path.write_text(text)
    with pytest.raises(InputError, match="neither a run folder nor a table"):
        read_recording(path)


def test_a_missing_path_is_told(tmp_path):
    with pytest.raises(InputError, match="no recording of this name"):
        read_recording(tmp_path / "none.csv")
