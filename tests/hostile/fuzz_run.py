"""Run one case in a forked process with limits, and judge how it ended.

A case ends well in one of these ways:

- status 0, and everything that the command line promises is there and not empty;
- status 2, one message, and no file or folder left behind, unless nothing was changed;
- status 3 for a trial that tripped, or a study that holds a failed analysis;
- status 130 for an analysis that Ctrl-C ended;
- status 1 for an analysis that a step ended which says in the field's words what it cannot simulate.

Everything else is a failure: a traceback anywhere, another status, death by a signal that was not
sent, more than 60 s of processor or 120 s in all, more than 2 GB of memory, a message that nobody
can read. Memory is counted from the fork: what the forking process holds already is not the case's.

A case may have a disturbance: Ctrl-C or the loss of the terminal at a moment of its start, few
files that it may open, or an interpreter of its own, as a user starts it.
"""

import contextlib
import math
import os
import re
import resource
import signal
import sys
import time
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from pyarrow.parquet import read_metadata

from slipbench.command import main
from tests.hostile.fuzz_commands import Case
from tests.hostile.fuzz_materials import exists

CPU = 60  # s of processor for a case
WALL = 120.0  # s in all, for what waits without working; the machine may be loaded
WAITING = 5  # s in all for 1 s of processor, for what waits for its workers or for a bus
MEMORY = 2 << 30  # bytes
LONGEST = 4000  # characters of a message
USAGE = re.compile(r"Usage: |^slipbench: \S", re.MULTILINE)
# The simulation of a part of the analysis diverged; other exceptions of a step are defects.
STEP_FAILED = re.compile(r"^slipbench: the analysis failed in [a-z ]+: PlantError: ", re.MULTILINE)
# Ctrl-C in a callback of LLVM, which Python prints and ignores.
SWALLOWED = re.compile(
    r"Exception ignored on calling ctypes callback.*?\nKeyboardInterrupt: ?\n", re.DOTALL
)
CHANGED_BY_INTERRUPT = (1, 130)
TICK = os.sysconf("SC_CLK_TCK")
# What a traceback of Python's own start names: no file of ours that imports anything.
OURS_AT_START = re.compile(
    r'File ".*/slipbench/(?!__init__\.py|__main__\.py", line \d+, in <module>)'
)


@dataclass
class Running:
    """A case in its process."""

    case: Case
    number: int
    pid: int
    began: float
    before: frozenset[str]
    resident: int  # bytes that the forking process held, which its fork begins with
    sent: list[signal.Signals] = field(default_factory=list)
    interrupted: bool = False  # because its command would take minutes


@dataclass(frozen=True)
class Ended:
    """How a case ended: its status (negative: a signal), what it cost, and what is wrong.

    memory: bytes at the peak, beyond what the forking process held.
    """

    running: Running
    status: int
    seconds: float
    memory: int
    stderr: str
    wrong: str


def start(case: Case, number: int) -> Running:
    """Fork a process for the case, with limits, in its folder and in a session of its own."""
    before = frozenset(_names(case.folder))
    resident = _own_memory()[1]
    sys.stdout.flush()
    pid = os.fork()
    if pid == 0:
        _in_the_child(case)
    return Running(case, number, pid, time.monotonic(), before, resident)


def _in_the_child(case: Case) -> None:
    status = 70
    try:
        for number in (signal.SIGINT, signal.SIGHUP):  # whatever the target inherited
            signal.signal(number, signal.SIG_DFL)
        os.setsid()
        os.chdir(case.folder)
        _redirect(case.folder)
        _limit(case)
        if case.disturbance.new_interpreter:
            words = new_interpreter([word.replace("\0", "") for word in case.argv])
            os.execve(words[0], words, os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)})
        signal.signal(signal.SIGINT, signal.default_int_handler)
        sys.argv = ["slipbench", *case.argv]
        try:
            main()
            status = 0
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else 1 if end.code else 0
        except BaseException:
            import traceback

            traceback.print_exc()
            status = 1
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(status)


def _limit(case: Case) -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (CPU, CPU + 1))
    limit = (MEMORY if case.disturbance.new_interpreter else _own_memory()[0]) + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if (files := case.disturbance.open_files) is not None:
        resource.setrlimit(resource.RLIMIT_NOFILE, (files, files))


def new_interpreter(argv: list[str]) -> list[str]:
    """Return the words that run a slipbench command line in a new interpreter."""
    return [sys.executable, "-m", "slipbench", *argv]


def processor_time(pid: int) -> float:
    """Return the processor time in s that a process has used; infinite once it has ended."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
    except OSError:
        return math.inf
    fields = state.rpartition(")")[2].split()
    return math.inf if fields[0] == "Z" else (int(fields[11]) + int(fields[12])) / TICK


def pythons_own(err: str) -> bool:
    """Whether a traceback arose before our code had begun: none of our lines could prevent it."""
    return not OURS_AT_START.search(err)


def _redirect(folder: Path) -> None:
    quiet = os.open(os.devnull, os.O_RDONLY)
    os.dup2(quiet, 0)
    for number, path in ((1, output(folder, "stdout")), (2, output(folder, "stderr"))):
        target = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        os.dup2(target, number)
    sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115 - a descriptor
    sys.stderr = open(2, "w", encoding="utf-8", errors="backslashreplace", closefd=False)  # noqa: SIM115 - a descriptor


def output(folder: Path, name: str) -> Path:
    """Return where a case's output is kept: beside its folder."""
    return folder.with_name(f"{folder.name}.{name}")


def _own_memory() -> tuple[int, int]:
    """Return the bytes of this process: of its address space, and those that a fork begins with.

    A fork maps the anonymous pages at once; those of files only when it touches them.
    """
    pages = Path("/proc/self/statm").read_text(encoding="ascii").split()[:3]
    size, resident, of_files = (int(number) * resource.getpagesize() for number in pages)
    return size, resident - of_files


def _memory(running: Running, usage: resource.struct_rusage) -> int:
    """Return the peak of a case's memory in bytes, without what it began with.

    The kernel's peak includes the fork's first pages. A new interpreter holds none of them, so its
    peak is its own if it is higher; otherwise it used less than the forking process.
    """
    peak = usage.ru_maxrss * 1024
    if running.case.disturbance.new_interpreter and peak > running.resident:
        return peak
    return max(0, peak - running.resident)


def step(running: Running) -> Ended | None:
    """Look after a running case; returns how it ended once it has."""
    elapsed = time.monotonic() - running.began
    _disturb(running, elapsed)
    if elapsed > WALL:
        os.killpg(running.pid, signal.SIGKILL)
    pid, status, usage = os.wait4(running.pid, os.WNOHANG)
    if pid == 0:
        return None
    _end_what_it_started(running.pid)
    return _judged(running, os.waitstatus_to_exitcode(status), usage)


def _disturb(running: Running, elapsed: float) -> None:
    """Send the signal of the case once its moment has come, to the whole group as a terminal does."""
    case = running.case
    after, disturbance = case.line.interrupt_after, case.disturbance
    spent = processor_time(running.pid)
    if math.isinf(spent):  # it has ended by itself
        return
    if disturbance.signal and spent > disturbance.after and not running.sent:
        running.sent.append(disturbance.signal)
        with contextlib.suppress(ProcessLookupError):  # it has not made its session yet, or ended
            os.killpg(running.pid, disturbance.signal)
    if after is None or running.interrupted:
        return
    if spent > after or elapsed > WAITING * after:
        running.interrupted = True
        running.sent.append(signal.SIGINT)
        os.killpg(running.pid, signal.SIGINT)


def _end_what_it_started(group: int) -> None:
    try:
        os.killpg(group, signal.SIGKILL)
    except ProcessLookupError:
        return


def _judged(running: Running, status: int, usage: resource.struct_rusage) -> Ended:
    folder = running.case.folder
    err = output(folder, "stderr").read_text(encoding="utf-8", errors="replace")
    err = SWALLOWED.sub("", err)
    out = output(folder, "stdout").read_text(encoding="utf-8", errors="replace")
    elapsed = time.monotonic() - running.began
    memory = _memory(running, usage)
    wrong = next(_wrong(running, status, err, out, elapsed, memory), "")
    return Ended(running, status, elapsed, memory, err, wrong)


def _wrong(
    running: Running, status: int, err: str, out: str, elapsed: float, memory: int
) -> Iterable[str]:
    if status == -signal.SIGXCPU or elapsed > WALL:
        yield f"hang: no end within {CPU} s of processor or {WALL:g} s"
    if "Traceback (most recent" in err and not (running.sent and pythons_own(err)):
        yield f"traceback: {_last_of_traceback(err)}"
    if status < 0 and -status not in running.sent:
        yield f"died of signal {-status}"
    if memory > MEMORY:
        yield f"memory: {memory / 2**30:.2f} GB"
    if len(err) > LONGEST and status == 2:
        yield f"a message of {len(err)} characters"
    yield from _wrong_for_status(running, status, err, out)


def _wrong_for_status(running: Running, status: int, err: str, out: str) -> Iterable[str]:
    case = running.case
    if status == 0:
        if "Usage:" not in out:
            yield from (f"status 0, but nothing in {n}" for n in _missing(case))
    elif status == 2:
        yield from _wrong_refusal(running, err)
    elif status == 3:
        if case.argv[0] not in ("trial", "paper", "explain-fleet", "prove"):
            yield "status 3"
    elif status == 1 and case.argv[0] == "explain" and STEP_FAILED.search(err):
        return
    elif not (running.sent and (status in CHANGED_BY_INTERRUPT or -status in running.sent)):
        yield f"status {status}"


def _wrong_refusal(running: Running, err: str) -> Iterable[str]:
    if not running.case.changes:
        yield "a valid line is refused"
    if not USAGE.search(err):
        yield "status 2 without a message"
    if running.case.disturbance.open_files is not None:
        return  # the system may refuse at any file, after others are written
    left = sorted(set(_names(running.case.folder)) - running.before)
    if left:
        yield f"status 2 leaves behind {', '.join(left[:3])}"


def _missing(case: Case) -> Iterable[str]:
    """Name what the command line promises and what is not there, or holds nothing."""
    for name, proof in case.out.items():
        path = case.folder / name / proof if proof else case.folder / name
        if not _holds_something(path):
            yield str(path.relative_to(case.folder))


def _holds_something(path: Path) -> bool:
    if not exists(path):
        return False
    if path.is_dir():
        return any(path.iterdir())
    match path.suffix:
        case ".csv":
            return path.read_bytes().count(b"\n") > 1  # a row below the names
        case ".parquet":
            return read_metadata(path).num_rows > 0
    if path.name == "run.toml":
        run = tomllib.loads(path.read_text(encoding="utf-8"))
        return run["run"]["frames"] > 0 or bool(run.get("tables"))
    return path.stat().st_size > 0


def _names(folder: Path) -> Iterable[str]:
    return (str(path.relative_to(folder)) for path in folder.rglob("*"))


def _last_of_traceback(err: str) -> str:
    """Return the exception and the place in our code where it arose."""
    lines = err[err.rindex("Traceback (most recent") :].splitlines()
    ours = [line.strip() for line in lines if re.search(r'File ".*/slipbench/', line)]
    ends = [line for line in lines[1:] if line and not line.startswith(" ")]
    place = (
        re.sub(r'File ".*/slipbench/(.*?)", line (\d+), in (\w+)', r"\1:\2 \3", ours[-1:][0])
        if ours
        else ""
    )
    return f"{ends[0][:160] if ends else '?'} ({place})"
