"""Every reader of a user's file refuses what is no regular file, at once and without waiting."""

import os
import signal
import socket
from contextlib import contextmanager

import pytest

from slipbench import dbc
from slipbench.identification.models import uncertainty_file
from slipbench.plant.errors import VehicleFileError
from slipbench.plant.vehicle_file import load_vehicle
from slipbench.protocol.configuration import load_toml
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.export import export_run
from slipbench.protocol.logs import read_log
from slipbench.protocol.recording import run_folder
from slipbench.protocol.tables import is_table, read_table
from slipbench.protocol.user_file import open_user_file, read_user_file


def frames_of(path):
    """Read a run folder whose frames.log is a link to `path`."""
    return run_folder.read(folder_with(path))


def export_of(path):
    """Export a run folder whose frames.log is `path`."""
    return export_run(folder_with(path), "asc")


def folder_with(path):
    """Make a run folder whose frames.log is what `path` is."""
    folder = path.parent / "run"
    folder.mkdir()
    (folder / "run.toml").write_text("")
    (folder / "database.dbc").write_bytes(dbc.MOTORBIKE.read_bytes())
    (folder / "roles.toml").write_bytes(dbc.MOTORBIKE_ROLES.read_bytes())
    moved = folder / "frames.log"
    moved.symlink_to("/dev/zero") if path.name == "device" else path.rename(moved)
    return folder


READERS = {
    "log": read_log,
    "table": read_table,
    "is_table": is_table,
    "toml": load_toml,
    "database": load_database,
    "vehicle": load_vehicle,
    "uncertainty": uncertainty_file.read,
    "run folder": frames_of,
    "export": export_of,
}
KINDS = ("fifo", "device", "socket", "folder", "loop", "missing")


@contextmanager
def kind_of_file(folder, kind):
    """Make something at a path that is no regular file."""
    path = folder / kind
    listener = socket.socket(socket.AF_UNIX)
    if kind == "fifo":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "socket":
        here = os.open(folder, os.O_RDONLY)
        listener.bind(f"/proc/self/fd/{here}/{kind}")  # a short name: 108 bytes are the most
        os.close(here)
    elif kind == "folder":
        path.mkdir()
    elif kind == "loop":
        path.symlink_to(path)
    with listener:
        yield path


@contextmanager
def at_most(seconds):
    """Raise TimeoutError in what takes longer, so that a hang is a failure."""

    def late(*_):
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("reader", READERS)
def test_what_is_no_file_is_refused_by_every_reader(reader, kind, tmp_path):
    if kind == "missing" and reader in ("run folder", "export"):
        pytest.skip("a folder without frames.log may be a recording of tables")
    with (
        kind_of_file(tmp_path, kind) as path,
        at_most(10),
        pytest.raises((InputError, VehicleFileError)),
    ):
        READERS[reader](path)


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("fifo", "a FIFO"),
        ("device", "a device"),
        ("socket", "a socket"),
        ("folder", "a folder"),
        ("loop", "symbolic links"),
        ("missing", "no such file"),
    ],
)
def test_the_message_names_what_was_found(kind, words, tmp_path):
    with kind_of_file(tmp_path, kind) as path, pytest.raises(InputError, match=words):
        open_user_file(path)


@pytest.mark.parametrize("name", ["a\0b", "x" * 300])
def test_a_name_that_no_file_can_have_is_refused(name, tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        open_user_file(tmp_path / name)


def test_content_is_read_up_to_a_limit(tmp_path):
    path = tmp_path / "data"
    path.write_bytes(bytes(100))
    assert read_user_file(path, 100) == bytes(100)
    with pytest.raises(InputError, match="too large"):
        read_user_file(path, 99)


@pytest.mark.parametrize("reader", ["table", "toml", "database", "vehicle", "log"])
def test_a_file_of_a_terabyte_is_refused(reader, tmp_path):
    """A sparse file takes no room on the disk, and all memory of whoever reads it."""
    path = tmp_path / "sparse"
    path.write_bytes(b"time,speed\n0.0,1.0\n")
    os.truncate(path, 1 << 40)
    with at_most(20), pytest.raises((InputError, VehicleFileError)):
        READERS[reader](path)
