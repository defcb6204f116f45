"""A process that keeps deadlines: real-time scheduling, locked memory, no garbage collection.

What the operating system refuses is told, never assumed. Linux only: elsewhere all is refused.
"""

import ctypes
import gc
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

PRIORITY = 80  # of SCHED_FIFO: above everything but the kernel's own threads
RECORDER_PRIORITY = 70  # of SCHED_FIFO: below the loop's, above every ordinary process
LATENCY = Path("/dev/cpu_dma_latency")  # keeps the processor out of deep sleep while it is open
THREADS = Path("/proc/self/task")
NO_SPIN = "the last part of each wait is not spun: there is one processor, and others need it"
CURRENT_AND_FUTURE = 3  # MCL_CURRENT | MCL_FUTURE of <sys/mman.h>
TIMER_SLACK, DEATH_SIGNAL = 29, 1  # PR_SET_TIMERSLACK, PR_SET_PDEATHSIG of <sys/prctl.h>


@contextmanager
def realtime_process(shares_one_processor: bool = False) -> Iterator[list[str]]:
    """Keep other programs, paging and the garbage collector out of the block.

    Where it `shares_one_processor` with those who have to keep up with it, it does not go before
    them. Yields what was refused, in words for run.toml.
    """
    refused: list[str] = []
    with ExitStack() as leaving:
        for what, claim in _CLAIMS:
            if shares_one_processor and claim is _first_in_line:
                refused.append(f"{what} was not asked for: listeners share the one processor")
                continue
            try:
                leaving.callback(claim())
            except (OSError, AttributeError) as cause:
                why = getattr(cause, "strerror", None) or "this system does not have it"
                refused.append(f"{what} was refused: {why}")
        yield refused


def one_processor() -> bool:
    """Tell whether this process has a single processor to run on, which all others need as well.

    Whoever spins there, or goes first and never rests, takes it from those who have to listen.
    """
    affinity = getattr(os, "sched_getaffinity", None)
    return (len(affinity(0)) if affinity else os.cpu_count() or 1) == 1


def run_before_ordinary_processes() -> None:
    """Give every thread of this process real-time scheduling below the loop's, where allowed.

    For a process that rests most of the time. Neither its work nor its end waits for ordinary
    processes then: a process that was killed has ended when each of its threads, those of numpy's
    libraries as well, has had a processor once more. A refusal is in the record already: the loop
    asks for the same right.
    """
    with suppress(OSError, AttributeError):
        for thread in THREADS.iterdir():
            os.sched_setscheduler(
                int(thread.name), os.SCHED_FIFO, os.sched_param(RECORDER_PRIORITY)
            )


def signal_on_parent_exit(number: int) -> None:
    """Ask for signal `number` when the process that started this one is gone."""
    try:
        _system("prctl", DEATH_SIGNAL, number)
    except (OSError, AttributeError):
        return  # elsewhere the devices notice the silence


def _system(name: str, *arguments: int) -> None:
    """Call a function of the C library that returns 0, or sets errno; raises OSError then."""
    library = ctypes.CDLL(None, use_errno=True)
    if getattr(library, name)(*map(ctypes.c_ulong, arguments)) != 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))


def _without_garbage_collection() -> Callable[[], None]:
    gc.collect()
    gc.freeze()
    gc.disable()

    def undo() -> None:
        gc.enable()
        gc.unfreeze()

    return undo


def _first_in_line() -> Callable[[], None]:
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    return lambda: os.sched_setscheduler(0, *before)


def _in_memory() -> Callable[[], None]:
    _system("mlockall", CURRENT_AND_FUTURE)
    return lambda: _system("munlockall")


def _without_slack() -> Callable[[], None]:
    """Let a wake-up that is due be due: without real-time scheduling Linux allows itself 50 us."""
    _system("prctl", TIMER_SLACK, 1)
    return lambda: _system("prctl", TIMER_SLACK, 0)


def _awake() -> Callable[[], None]:
    file = LATENCY.open("wb", buffering=0)
    try:
        file.write(bytes(4))
    except OSError:
        file.close()
        raise
    return file.close


_CLAIMS = (
    ("freezing the garbage collector", _without_garbage_collection),
    ("locked memory (mlockall)", _in_memory),
    ("a processor that stays awake (/dev/cpu_dma_latency)", _awake),
    ("an exact timer (PR_SET_TIMERSLACK)", _without_slack),
    ("real-time scheduling (SCHED_FIFO)", _first_in_line),
)
