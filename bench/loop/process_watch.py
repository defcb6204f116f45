"""End of another process, read in one system call from its end of a pipe.

The kernel closes the pipe when the watched process ends, however it ends. The loop reads this by itself
in every tick, so that no ordinary process, which may wait for a processor, stands between. Shared memory
is not enough here: a process that was killed cannot write to it.
"""

import multiprocessing
import select
from collections.abc import Callable
from multiprocessing.connection import Connection


def process_pipe() -> tuple[Connection, Connection]:
    """Make the two ends of a pipe: one for the process that watches, one for the watched one.

    Whoever starts the watched process closes its own copy of the second end afterwards.
    """
    return multiprocessing.get_context("spawn").Pipe(duplex=False)


class ProcessWatch:
    """Whether the process that holds the other end of a pipe has ended."""

    def __init__(self, pipe: Connection) -> None:
        """Watch the process that holds the second end of `process_pipe`."""
        self._ended: Callable[[], object]
        if hasattr(select, "poll"):  # POSIX; ten times as fast as the connection's own `poll`
            poll = select.poll()
            poll.register(pipe.fileno(), select.POLLIN | select.POLLHUP)
            self._ended = lambda: poll.poll(0)
        else:
            self._ended = pipe.poll
        self._pipe = pipe

    def ended(self) -> bool:
        """Whether the process has ended; once true, always true."""
        try:
            return bool(self._ended())
        except BrokenPipeError:  # Windows reports the end this way
            return True
