"""Real-time process: real-time scheduling, locked memory, no garbage collection.

Each right that the operating system refuses is reported. Linux only: other systems refuse all.
"""

import ctypes
import gc
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

PRIORITY = 80  # of SCHED_FIFO: above everything except threads of the kernel
RECORDER_PRIORITY = 70  # of SCHED_FIFO: below the loop's, above every ordinary process
LATENCY = Path("/dev/cpu_dma_latency")  # prevents deep sleep states of the processor while open
THREADS = Path("/proc/self/task")
NO_SPIN = "no busy wait before each tick: there is only one processor, and other processes need it"
CURRENT_AND_FUTURE = 3  # MCL_CURRENT | MCL_FUTURE of <sys/mman.h>
TIMER_SLACK, DEATH_SIGNAL = 29, 1  # PR_SET_TIMERSLACK, PR_SET_PDEATHSIG of <sys/prctl.h>


@contextmanager
def realtime_process(shares_one_processor: bool = False) -> Iterator[list[str]]:
    """Yield the refused rights, in words for run.toml; the block runs as a real-time process.

    Where it `shares_one_processor` with the receivers of its frames, it requests no real-time
    scheduling, so that they can keep up.
    """
    refused: list[str] = []
    with ExitStack() as leaving:
        for what, claim in _CLAIMS:
            if shares_one_processor and claim is _realtime_scheduling:
                refused.append(f"{what} was not requested: receivers share the only processor")
                continue
            try:
                leaving.callback(claim())
            except (OSError, AttributeError) as cause:
                why = getattr(cause, "strerror", None) or "this system does not have it"
                refused.append(f"{what} was refused: {why}")
        yield refused


def one_processor() -> bool:
    """Whether this process may run on one processor only, which the other processes need as well.

    A busy wait there, or a high priority without pauses, would stop the receivers of its frames.
    """
    affinity = getattr(os, "sched_getaffinity", None)
    return (len(affinity(0)) if affinity else os.cpu_count() or 1) == 1


def run_before_ordinary_processes() -> None:
    """Give all threads of this process a real-time priority below the loop's, where allowed.

    For a process that sleeps most of the time. Neither its work nor its end then waits for ordinary
    processes: a killed process ends only when each of its threads, including those of numpy's
    libraries, has been scheduled once more. A refusal is not reported here, because the loop requests
    the same right and reports it.
    """
    with suppress(OSError, AttributeError):
        for thread in THREADS.iterdir():
            os.sched_setscheduler(
                int(thread.name), os.SCHED_FIFO, os.sched_param(RECORDER_PRIORITY)
            )


def signal_on_parent_exit(number: int) -> None:
    """Request signal `number` for the time when the parent of this process ends."""
    try:
        _system("prctl", DEATH_SIGNAL, number)
    except (OSError, AttributeError):
        return  # on other systems the watchdogs of the devices return authority


def _system(name: str, *arguments: int) -> None:
    """Call a function of the C library. Raises OSError with errno where it does not return 0."""
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


def _realtime_scheduling() -> Callable[[], None]:
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    return lambda: os.sched_setscheduler(0, *before)


def _locked_memory() -> Callable[[], None]:
    _system("mlockall", CURRENT_AND_FUTURE)
    return lambda: _system("munlockall")


def _exact_timer() -> Callable[[], None]:
    """Reduce the timer slack to 1 ns: without real-time scheduling Linux uses 50 us."""
    _system("prctl", TIMER_SLACK, 1)
    return lambda: _system("prctl", TIMER_SLACK, 0)


def _no_deep_sleep() -> Callable[[], None]:
    file = LATENCY.open("wb", buffering=0)
    try:
        file.write(bytes(4))
    except OSError:
        file.close()
        raise
    return file.close


_CLAIMS = (
    ("freezing the garbage collector", _without_garbage_collection),
    ("locked memory (mlockall)", _locked_memory),
    ("a processor that stays awake (/dev/cpu_dma_latency)", _no_deep_sleep),
    ("an exact timer (PR_SET_TIMERSLACK)", _exact_timer),
    ("real-time scheduling (SCHED_FIFO)", _realtime_scheduling),
)
