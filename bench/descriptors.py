"""Open files that a command of the bench needs: pipes, shared memory, sockets and records."""

from slipbench.protocol.errors import InputError

NEEDED = 64  # with room: a trial with a virtual motorcycle opens some 25


def require_descriptors(needed: int = NEEDED) -> None:
    """Allow this process `needed` open files; raises InputError where the system does not.

    Without them a command would end at any point, with a part of its processes started.
    """
    try:
        import resource
    except ImportError:  # Windows has no such limit
        return
    allowed, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    if allowed == resource.RLIM_INFINITY or allowed >= needed:
        return
    if most != resource.RLIM_INFINITY and most < needed:
        raise InputError(
            "too few open files are allowed (ulimit -n)",
            expected=f"at least {needed}",
            found=str(most),
            remedy=f"run `ulimit -n {needed}` as a user who may, or start from another shell",
        )
    resource.setrlimit(resource.RLIMIT_NOFILE, (needed, most))
