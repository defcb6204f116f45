"""Ctrl-C at any moment of a start, and what the operating system refuses."""

import errno
import re
import signal
import subprocess
import sys
import time
from random import Random

import pytest

from slipbench import command
from tests.hostile.fuzz_run import new_interpreter, processor_time, pythons_own

SEED = 7
MOMENTS = 12


def _heed_interrupts():
    """A background job of a shell ignores them, and its children inherit that."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def test_an_interrupt_at_any_moment_of_the_start_is_no_traceback(tmp_path):
    print(f"seed {SEED}")
    rng, ended = Random(SEED), []
    for _ in range(MOMENTS):
        moment = rng.uniform(0.0, 0.15)  # s of processor; the imports take about 0.12 s
        with subprocess.Popen(
            new_interpreter(["doctor"]),
            cwd=tmp_path,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=_heed_interrupts,
        ) as process:
            while processor_time(process.pid) < moment:
                time.sleep(0.002)
            process.send_signal(signal.SIGINT)
            _, err = process.communicate()
        ended.append((moment, process.returncode, err))
    wrong = [end for end in ended if "Traceback" in end[2] and not pythons_own(end[2])]
    assert wrong == []
    assert {status for _, status, _ in ended} <= {0, 1, 130, -signal.SIGINT}
    assert any(status for _, status, _ in ended)


IN_A_FINALIZER = """
import signal, sys, time
from slipbench import command

class Closing:
    def __del__(self):
        signal.raise_signal(signal.SIGINT)

def run():
    Closing()
    time.sleep(60)

command.app = run
command.main()
"""


def test_an_interrupt_in_a_finalizer_is_not_lost():
    """Python alone prints it and goes on: the command would end after a minute, with status 0."""
    ended = subprocess.run(
        [sys.executable, "-c", IN_A_FINALIZER],
        capture_output=True,
        text=True,
        timeout=15,
        preexec_fn=_heed_interrupts,
    )
    assert (ended.returncode, ended.stderr) == (130, "Aborted!\n")


def _ends(monkeypatch, fault):
    def refuse():
        raise fault

    monkeypatch.setattr(command, "app", refuse)
    command.main()


@pytest.mark.parametrize(
    "fault",
    [
        FileNotFoundError(errno.ENOENT, "No such file or directory", "mine/trial.toml"),
        PermissionError(errno.EACCES, "Permission denied", b"/srv/mine.csv"),
        OSError(errno.ENOSPC, "No space left on device"),
        OSError(errno.EMFILE, "Too many open files", str(command.PACKAGE / "dbc/motorbike.dbc")),
    ],
)
def test_what_a_user_can_act_on_is_a_message(monkeypatch, capsys, fault):
    with pytest.raises(SystemExit, match="2"):
        _ends(monkeypatch, fault)
    assert re.match(r"slipbench: .*the operating system refuses: ", capsys.readouterr().err)


@pytest.mark.parametrize(
    "fault",
    [
        FileNotFoundError(errno.ENOENT, "No such file", str(command.PACKAGE / "dbc/motorbike.dbc")),
        FileNotFoundError(errno.ENOENT, "No such file or directory"),
        OSError(errno.EINVAL, "Invalid argument"),
        OSError(errno.EBADF, "Bad file descriptor", "mine.csv"),
    ],
)
def test_a_defect_of_the_package_stays_a_traceback(monkeypatch, fault):
    with pytest.raises(OSError, match=re.escape(fault.strerror)):
        _ends(monkeypatch, fault)


@pytest.mark.parametrize("fault", [KeyboardInterrupt(), SystemError(), RuntimeError()])
def test_an_interrupt_outside_a_command_ends_it(monkeypatch, capsys, fault):
    """Compiled code may raise SystemError, and the making of a class RuntimeError, because of it."""
    if not isinstance(fault, KeyboardInterrupt):
        fault.__cause__ = KeyboardInterrupt()
    with pytest.raises(SystemExit, match="130"):
        _ends(monkeypatch, fault)
    assert capsys.readouterr().err == "Aborted!\n"


@pytest.mark.parametrize("kind", [SystemError, RuntimeError])
def test_another_system_error_stays_a_traceback(monkeypatch, kind):
    with pytest.raises(kind):
        _ends(monkeypatch, kind("bad call"))
