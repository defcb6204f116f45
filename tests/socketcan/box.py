"""A box: one command on a kernel with vcan0 and vcan1 that nobody else shares."""

import contextlib
import os
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from tests.socketcan.kernels import HERE, Kernel

ROOT = HERE.parent.parent
SCRATCH = Path("/dev/shm")  # memory: a disk that is busy stops a user-mode kernel altogether
BROUGHT_ALONG = ("PATH", "HOME", "LANG", "PYTHONPATH", "SLIPBENCH_RECORDINGS")
BOOT = 60.0  # s that a kernel may take to come up and go down, on a machine that others load


@dataclass(frozen=True)
class Ended:
    """How a command ended. `status` is None where it, or its kernel, had to be killed."""

    status: int | None
    output: str
    console: str  # what the kernel itself said


@dataclass(frozen=True)
class Tested:
    """What pytest found inside a box."""

    ended: Ended
    tests: int
    skipped: int
    failed: int  # errors included

    @property
    def closing_line(self) -> str:
        """Pytest's own last line."""
        return (self.ended.output.strip().splitlines() or ["no output"])[-1].strip("= ")


def run(kernel: Kernel, command: Sequence[str], limit: float) -> Ended:
    """Run `command` in the checkout's folder, for at most `limit` s of the kernel's own time."""
    with _folder() as box:
        return _run(kernel, box, command, limit, {})


def run_tests(kernel: Kernel, paths: Sequence[str], limit: float) -> Tested:
    """Run the tests in `paths` inside, with the interpreter that runs this; see `run`."""
    with _folder() as box:
        command = (
            sys.executable,
            "-m",
            "pytest",
            *paths,
            "-p",
            "no:cacheprovider",
            "--color=no",
            f"--basetemp={SCRATCH / box.name}",
            f"--junitxml={box / 'results.xml'}",
        )
        ended = _run(kernel, box, command, limit, {"SLIPBENCH_VCAN": "vcan0"})
        return _results(box / "results.xml", ended)


@contextlib.contextmanager
def _folder() -> Iterator[Path]:
    box = Path(tempfile.mkdtemp(prefix="slipbench-box-"))
    try:
        yield box
    finally:
        shutil.rmtree(box, ignore_errors=True)


def _run(
    kernel: Kernel, box: Path, command: Sequence[str], limit: float, extra: Mapping[str, str]
) -> Ended:
    _write_script(box / "command", command, extra)
    start = kernel.start(box, limit)
    with (box / "console").open("wb") as console:
        process = subprocess.Popen(
            start.arguments,
            env=start.environment,
            cwd=ROOT,
            start_new_session=True,
            stdin=subprocess.DEVNULL,
            stdout=console,
            stderr=subprocess.STDOUT,
        )
        try:
            process.wait(limit * start.slowness + BOOT)
        except subprocess.TimeoutExpired:
            pass
        finally:
            _kill(process)
    status = _text(box / "status").strip()
    return Ended(int(status) if status else None, _text(box / "output"), _text(box / "console"))


def _write_script(path: Path, command: Sequence[str], extra: Mapping[str, str]) -> None:
    """The environment does not reach another kernel: the command brings it along."""
    environment = {name: os.environ[name] for name in BROUGHT_ALONG if name in os.environ}
    exports = "".join(
        f"export {name}={shlex.quote(value)}\n" for name, value in {**environment, **extra}.items()
    )
    path.write_text(
        "#!/bin/sh\n"
        f"{shlex.quote(str(HERE / 'interfaces.sh'))} || exit 125\n"
        f"{exports}cd {shlex.quote(str(ROOT))} && exec {shlex.join(command)}\n",
        encoding="utf-8",
    )
    path.chmod(0o755)


def _kill(process: "subprocess.Popen[bytes]") -> None:
    """End everything that was started: a user-mode kernel is several processes of one group."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace") if path.exists() else ""


def _results(path: Path, ended: Ended) -> Tested:
    if not path.exists():
        return Tested(ended, 0, 0, 0)
    suites = ElementTree.parse(path).getroot().iter("testsuite")
    counts = [
        [int(suite.attrib[what]) for what in ("tests", "skipped", "failures", "errors")]
        for suite in suites
    ]
    tests, skipped, failures, errors = (sum(column) for column in zip(*counts, strict=True))
    return Tested(ended, tests, skipped, failures + errors)
