"""The kernels with CAN that there may be: this machine's own, and one that runs as a program."""

import contextlib
import os
import shutil
import socket
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from tests.socketcan.preload import FASTER, preload

HERE = Path(__file__).parent
MODULES = Path("/usr/lib/uml/modules")
MEMORY = 1 << 30  # bytes that the user-mode kernel manages; only what is touched is taken

_NAMESPACE = ("unshare", "--map-root-user", "--net")


@dataclass(frozen=True)
class Start:
    """What to execute so that `command` in the box's folder runs on the kernel.

    slowness  how many seconds may pass outside while one passes on the kernel
    """

    arguments: tuple[str, ...]
    environment: Mapping[str, str]
    slowness: int = 1


class Kernel(Protocol):
    """A kernel on which a command can be run with vcan interfaces of its own."""

    name: str

    def missing(self) -> str:
        """Say what is missing, and how to get it; empty where the kernel can be used."""

    def start(self, box: Path, limit: float) -> Start:
        """Run `box/command` for at most `limit` s of the kernel's own time.

        It leaves `box/output` and `box/status`.
        """


class Native:
    """This machine's kernel, in a network namespace that ends with the command."""

    name = "this machine's kernel"

    def missing(self) -> str:
        try:
            socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
        except OSError as fault:
            return f"{self.name} has no CAN ({fault.strerror}); try: modprobe vcan"
        probe = (*_NAMESPACE, "ip", "link", "add", "dev", "probe", "type", "vcan")
        tried = subprocess.run(probe, capture_output=True, text=True, check=False)
        if tried.returncode == 0:
            return ""
        return f"{self.name} makes no vcan ({tried.stderr.strip()}); try: modprobe vcan"

    def start(self, box: Path, limit: float) -> Start:
        script = (
            'timeout --kill-after=5 "$1" "$0/command" > "$0/output" 2>&1 < /dev/null; '
            'echo $? > "$0/status"'
        )
        return Start((*_NAMESPACE, "sh", "-c", script, str(box), str(limit)), os.environ)


class UserModeLinux:
    """Debian's user-mode Linux: a kernel as a program, with this machine's files as its root."""

    name = "user-mode Linux"

    def missing(self) -> str:
        packages = {
            "user-mode-linux": shutil.which("linux.uml") and MODULES.is_dir(),
            "kmod": _system_program("insmod"),
            "iproute2": _system_program("ip"),
            "can-utils": _system_program("candump"),
            "gcc libc6-dev": shutil.which("gcc"),
        }
        absent = [package for package, present in packages.items() if not present]
        return f"apt-get install {' '.join(absent)}" if absent else ""

    def start(self, box: Path, limit: float) -> Start:
        arguments = (
            "linux.uml",
            "rootfstype=hostfs",
            "rootflags=/",
            "rw",
            f"mem={MEMORY >> 20}M",
            f"init={HERE / 'init.sh'}",
            f"BOX={box}",
            f"LIMIT={limit:g}",
            "con=null",
            "con0=null,fd:1",
            "ssl=null",
            "quiet",
            f"uml_dir={box}/",
            "umid=uml",
        )
        memory = {"TMPDIR": str(_memory_folder())}
        return Start(arguments, {**os.environ, **preload(box), **memory}, FASTER)


def _system_program(name: str) -> bool:
    return shutil.which(name, path=os.defpath + ":/usr/sbin:/sbin") is not None


def _memory_folder() -> Path:
    """Find room for the kernel's memory: a file that may be mapped for execution."""
    candidates = [Path("/dev/shm"), Path(tempfile.gettempdir()), Path("/var/tmp")]
    for folder in candidates:
        with contextlib.suppress(OSError):
            about = os.statvfs(folder)
            room = about.f_bavail * about.f_frsize
            if room > MEMORY and not about.f_flag & os.ST_NOEXEC and os.access(folder, os.W_OK):
                return folder
    raise OSError(f"no folder has {MEMORY >> 20} MB free without noexec: {candidates}")


def usable() -> Kernel | str:
    """Give the first kernel that can be used, or say what each is missing."""
    kernels: tuple[Kernel, ...] = (Native(), UserModeLinux())
    faults = {kernel.name: kernel.missing() for kernel in kernels}
    for kernel in kernels:
        if not faults[kernel.name]:
            return kernel
    return "; or ".join(f"{name}: {fault}" for name, fault in faults.items())
