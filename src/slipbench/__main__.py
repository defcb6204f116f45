"""Run the command: `slipbench`, or `python -m slipbench`.

This module imports little, so that Ctrl-C works as it should from the first moment.
"""

import _signal as signal  # type: ignore[import-not-found]  # built in; the import of signal takes a millisecond


def main() -> None:
    """Import the command and run it; Ctrl-C before it begins ends the process in silence."""
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:  # else: a caller chose, such as nohup
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from slipbench.command import main as run

    signal.signal(signal.SIGINT, before)
    run()


if __name__ == "__main__":
    main()
