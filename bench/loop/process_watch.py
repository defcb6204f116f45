"""Detection of the end of another process, in one system call on a pipe.

The kernel closes the pipe when the watched process ends, however it ends. The loop itself checks this in
every tick, because an ordinary process between them may have to wait for a processor. Shared memory
is not enough: a process that was killed cannot write to it.
"""

import multiprocessing
import select
from collections.abc import Callable
from multiprocessing.connection import Connection


def process_pipe() -> tuple[Connection, Connection]:
    """Two ends of a pipe: the first for the watching process, the second for the watched one.

    The parent of the watched process closes its own copy of the second end afterwards.
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
