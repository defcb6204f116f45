"""What is said of a command in a box can be believed."""

import os
import sys
import time
from pathlib import Path

import pytest

from tests.socketcan import box
from tests.socketcan.kernels import Kernel
from tests.socketcan.preload import FASTER


def processes() -> set[str]:
    """The command lines of everything that runs here."""
    lines = set()
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            lines.add(path.read_text(encoding="utf-8", errors="replace"))
        except OSError:
            continue  # it has ended
    return lines


def test_status_and_output_come_out(kernel: Kernel) -> None:
    ended = box.run(kernel, ["sh", "-c", "echo out; echo err >&2; exit 7"], limit=60)
    assert (ended.status, ended.output) == (7, "out\nerr\n"), ended.console


def test_the_same_interpreter_runs_inside_with_devices_and_a_home(kernel: Kernel) -> None:
    code = """if True:
        import multiprocessing, os, pathlib, sys
        multiprocessing.Semaphore()
        assert len(set(os.urandom(64))) > 8
        assert pathlib.Path("/dev/null").write_bytes(b"x") == 1
        assert os.environ["HOME"] and os.getcwd()
        print(sys.executable, sorted(os.listdir("/sys/class/net")))
    """
    ended = box.run(kernel, [sys.executable, "-c", code], limit=60)
    assert ended.output == f"{sys.executable} ['lo', 'vcan0', 'vcan1']\n"


def test_a_command_that_hangs_is_ended_and_leaves_nothing(kernel: Kernel) -> None:
    marker = f"31536000.{os.getpid()}"
    began = time.monotonic()
    ended = box.run(kernel, ["sh", "-c", f"echo begun; sleep {marker}"], limit=3)
    assert time.monotonic() - began < 30
    assert ended.status == 124
    assert ended.output == "begun\n"
    assert not [line for line in processes() if marker in line]


def test_a_kernel_that_hangs_is_killed_with_all_its_processes(
    kernel: Kernel, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(box, "BOOT", 5.0 - 60 * FASTER)
    before = len([line for line in processes() if "slipbench-box-" in line])
    ended = box.run(kernel, ["sh", "-c", "while :; do :; done"], limit=60)
    assert ended.status is None
    time.sleep(0.2)
    assert len([line for line in processes() if "slipbench-box-" in line]) <= before


def test_time_inside_passes_as_it_should(kernel: Kernel) -> None:
    """On user-mode Linux it passes by itself: whoever sleeps, and he alone, sees a second pass."""
    code = """if True:
        import time
        began = time.monotonic()
        time.sleep(1.0)
        slept = time.monotonic()
        while time.monotonic() < slept + 0.01:
            pass
        spun = time.monotonic()
        print(f"{slept - began:.1f} {spun - slept:.2f}")
    """
    ended = box.run(kernel, [sys.executable, "-c", code], limit=60)
    assert ended.output == "1.0 0.01\n"


@pytest.mark.parametrize(
    ("body", "tests", "skipped", "failed"),
    [
        ("def test_good(): pass", 1, 0, 0),
        ("def test_bad(): assert False", 1, 0, 1),
        ("import pytest\ndef test_not_run(): pytest.skip('no')", 1, 1, 0),
        ("x = 1", 0, 0, 0),
        ("syntax error", 1, 0, 1),
    ],
)
def test_what_pytest_finds_inside_is_counted(
    kernel: Kernel, tmp_path: Path, body: str, tests: int, skipped: int, failed: int
) -> None:
    path = tmp_path / "test_inner.py"
    path.write_text(body, encoding="utf-8")
    found = box.run_tests(kernel, [str(path)], limit=60)
    assert (found.tests, found.skipped, found.failed) == (tests, skipped, failed), found.ended
    assert (found.ended.status == 0) == (tests == 1 and not failed)
