"""A command that is interrupted while it starts, or is allowed few files, ends without a traceback."""

import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from slipbench.bench.descriptors import NEEDED, require_descriptors
from slipbench.protocol.errors import InputError
from tests.paths import TRIALS

WITHIN = 120.0  # s, on a machine however loaded
TRIAL = str(TRIALS / "throttle_sweep.toml")


@pytest.fixture(autouse=True)
def _signals_that_end_a_process() -> Iterator[None]:
    """Commands inherit what is ignored: under `nohup` or in the background these tests run as well."""
    ignored = [n for n in (signal.SIGINT, signal.SIGHUP) if signal.getsignal(n) == signal.SIG_IGN]
    for number in ignored:
        signal.signal(number, signal.SIG_DFL)
    yield
    for number in ignored:
        signal.signal(number, signal.SIG_IGN)


def command(folder: Path, *arguments: str, **options: object) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-m", "slipbench", *arguments],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        start_new_session=True,
        **options,  # type: ignore[call-overload]
    )


def spawned(process: int) -> int:
    """Number of running child processes of a process."""
    return len(Path(f"/proc/{process}/task/{process}/children").read_text().split())


@pytest.mark.parametrize("children", [1, 2, 3])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP])
def test_a_group_that_is_interrupted_while_a_trial_starts_ends_without_a_traceback(
    tmp_path: Path, number: int, children: int
) -> None:
    """The signal is sent as soon as that many processes exist, while they still import."""
    with command(tmp_path, "trial", TRIAL, "--real-time") as trial:
        deadline = time.monotonic() + WITHIN
        while spawned(trial.pid) < children and time.monotonic() < deadline:
            time.sleep(0.001)
        os.killpg(trial.pid, number)
        said, _ = trial.communicate(timeout=WITHIN)
    assert "Traceback" not in said, said
    assert "resource_tracker" not in said
    assert trial.returncode != 0
    with pytest.raises(ProcessLookupError):
        _wait_for_group(trial.pid)


def _wait_for_group(group: int) -> None:
    """Wait until no process of the group is left; raises ProcessLookupError then."""
    deadline = time.monotonic() + WITHIN
    while time.monotonic() < deadline:
        os.killpg(group, 0)
        time.sleep(0.05)


@pytest.mark.parametrize(
    "arguments",
    [
        ("trial", TRIAL, "--real-time"),
        ("trial", TRIAL),
        ("vehicle", TRIAL, "--interface", "slipbench"),
        ("replay", "x.log", "--interface", "slipbench"),
    ],
)
def test_a_command_with_too_few_file_descriptors_reports_it_and_leaves_no_file(
    tmp_path: Path, arguments: tuple[str, ...]
) -> None:
    (tmp_path / "x.log").write_text("(1.000000) can0 123#00\n")

    def few() -> None:
        resource.setrlimit(resource.RLIMIT_NOFILE, (12, 12))

    with command(tmp_path, *arguments, preexec_fn=few) as process:
        said, _ = process.communicate(timeout=WITHIN)
    assert process.returncode == 2, said
    assert "Traceback" not in said
    assert f"at least {NEEDED}" in said
    assert {path.name for path in tmp_path.iterdir()} == {"x.log"}


def test_a_low_limit_that_may_be_raised_is_raised() -> None:
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (50, before[1]))
    try:
        require_descriptors()
        assert resource.getrlimit(resource.RLIMIT_NOFILE)[0] == NEEDED
        with pytest.raises(InputError, match="too few open files"):
            require_descriptors(1 << 62)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, before)
