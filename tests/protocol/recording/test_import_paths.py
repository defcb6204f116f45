"""An import writes to any path that the system accepts, and a failed one leaves nothing."""

import os

import pytest

from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.import_log import Capture, import_capture

ROLES = '[tables.main]\ntime_unit = "s"\n[quantities]\nspeed = "V"\n[roles.speed]\ncolumn = "y"\nunit = "V"\n'


def _capture(folder, rows):
    (folder / "roles.toml").write_text(f'title = "A motor"\n{ROLES}')
    (folder / "main.csv").write_text("time,y\n" + rows)
    return Capture(folder / "main.csv", folder / "roles.toml")


def test_a_path_with_bytes_that_are_no_text_is_written(tmp_path):
    out = tmp_path / os.fsdecode(b"out\xff")
    recording = import_capture(_capture(tmp_path, "0.0,1.0\n0.1,2.0\n0.2,3.0\n"), out)
    assert list(recording.channels["speed"].value) == [1.0, 2.0, 3.0]


def test_a_failed_import_leaves_none_of_the_folders_that_it_made(tmp_path):
    capture = _capture(tmp_path, "0.0,x\n0.1,x\n")
    before = set(tmp_path.rglob("*"))
    with pytest.raises(InputError):
        import_capture(capture, tmp_path / "a" / "b" / "out")
    assert set(tmp_path.rglob("*")) == before
