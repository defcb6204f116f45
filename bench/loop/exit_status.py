"""Exit status of a process in words."""

from multiprocessing.process import BaseProcess


def exit_reason(process: BaseProcess) -> str:
    """How `process` failed, in words; empty where it runs or ended without an error."""
    status = process.exitcode
    if not status:
        return ""
    return f"signal {-status}" if status < 0 else f"exit status {status}"
