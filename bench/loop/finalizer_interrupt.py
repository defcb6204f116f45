"""Ctrl-C while a finalizer runs: Python prints it and goes on, so it is sent again afterwards."""

import signal
import sys
from _thread import interrupt_main
from contextlib import suppress
from threading import Timer, main_thread

AFTER = 0.05
"""Seconds until it is sent again: the finalizer and the hook must have returned."""


def keep_interrupts() -> None:
    """Send the main thread its interrupt again where a finalizer swallowed it.

    A package's `__del__` that closes files is such a finalizer. Other exceptions in finalizers are
    printed as before.
    """
    printed = sys.unraisablehook

    def hook(lost: "sys.UnraisableHookArgs") -> None:
        if not isinstance(lost.exc_value, KeyboardInterrupt):
            printed(lost)
            return
        with suppress(RuntimeError):  # no thread starts any more while the interpreter ends
            Timer(AFTER, _interrupt).start()

    sys.unraisablehook = hook


def _interrupt() -> None:
    """Send a signal: a mere flag, all that Windows has, would not end a sleep or a read."""
    ident = main_thread().ident
    if sys.platform != "win32" and ident is not None:
        signal.pthread_kill(ident, signal.SIGINT)
    else:
        interrupt_main()
