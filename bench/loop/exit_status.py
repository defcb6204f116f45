"""How a process ended that ought not to have: in words."""

from multiprocessing.process import BaseProcess


def exit_reason(process: BaseProcess) -> str:
    """Say how `process` ended; empty where it lives or ended well."""
    status = process.exitcode
    if not status:
        return ""
    return f"signal {-status}" if status < 0 else f"exit status {status}"
