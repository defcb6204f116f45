"""Check this computer: versions, extras, CAN interfaces, kernel CAN, real-time rights."""

import os
import platform
import resource
import shutil
import socket
from collections.abc import Iterator
from contextlib import suppress
from ctypes.util import find_library
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import Literal

from slipbench.bench.loop.realtime_process import PRIORITY, one_processor
from slipbench.plant.compiled import cache_folder
from slipbench.protocol.extras import EXTRA_OF, install_command

BASE = ("numpy", "scipy", "numba", "python-can", "cantools", "control")
DRIVERS = {"PCAN": "pcanbasic", "Kvaser": "canlib"}  # and the library that python-can loads
CAN_DEVICE = "280"  # ARPHRD_CAN of <linux/if_arp.h>
BITRATE = "type can bitrate 1000000"
LEAST_FILES = 256  # open files, of a live trial with its recorder, its bus and its pipes
LEAST_SPACE = 1e9  # bytes; an hour of a full bus at 1 Mbit/s is 0.9 GB of candump text
LIMITS_FILE = "/etc/security/limits.d/slipbench.conf"


@dataclass(frozen=True)
class Check:
    """One line. state: ok, note (not everyone needs it), warning, or error (nothing runs)."""

    topic: str
    state: Literal["ok", "note", "warning", "error"]
    found: str
    remedy: str = ""


def checks() -> Iterator[Check]:
    """Yield every check of this computer; none changes anything on it."""
    yield from _versions()
    yield from _extras()
    yield from _interfaces()
    yield from _real_time()
    yield from _files()


def _versions() -> Iterator[Check]:
    ours = f"slipbench {version('slipbench')}, Python {platform.python_version()}"
    yield Check("versions", "ok", f"{ours}, {platform.system()} {platform.release()}")
    found = {name: _version(name) for name in BASE}
    absent = [name for name, number in found.items() if not number]
    text = ", ".join(f"{name} {number or 'absent'}" for name, number in found.items())
    if absent:
        yield Check("libraries", "error", text, "pip install --force-reinstall slipbench")
    else:
        yield Check("libraries", "ok", text)


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


def _extras() -> Iterator[Check]:
    for extra in dict.fromkeys(EXTRA_OF.values()):
        libraries = [name for name, its in EXTRA_OF.items() if its == extra]
        absent = [name for name in libraries if find_spec(name) is None]
        if absent:
            found = f"{', '.join(absent)} not installed"
            yield Check(f"slipbench[{extra}]", "note", found, install_command(absent[0]))
        else:
            yield Check(f"slipbench[{extra}]", "ok", ", ".join(libraries))


def _interfaces() -> Iterator[Check]:
    yield _kernel_can()
    for name, state in _can_devices():
        if state in ("up", "unknown"):  # a virtual interface that is up has the state "unknown"
            yield Check(f"interface {name}", "ok", "up")
        else:
            remedy = f"sudo ip link set {name} up {'' if name.startswith('v') else BITRATE}".strip()
            yield Check(f"interface {name}", "warning", state, remedy)
    for name, library in DRIVERS.items():
        if find_library(library):
            yield Check(f"{name} driver", "ok", library)
        else:
            needed = f"only for {name} hardware through the maker's driver"
            yield Check(f"{name} driver", "note", f"not found; needed {needed}")


def _kernel_can() -> Check:
    if not hasattr(socket, "AF_CAN"):
        return Check("kernel CAN", "note", "this system has no SocketCAN")
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except OSError as cause:
        found, remedy = f"SocketCAN cannot be opened: {cause.strerror}", "sudo modprobe can_raw"
        return Check("kernel CAN", "warning", found, remedy)
    if any(_can_devices()):
        return Check("kernel CAN", "ok", "SocketCAN")
    remedy = "connect the adapter and load its driver, for example: sudo modprobe peak_usb"
    return Check("kernel CAN", "note", "SocketCAN, but no CAN interface", remedy)


def _can_devices() -> Iterator[tuple[str, str]]:
    """Yield name and state of each CAN interface of the kernel."""
    for kind in sorted(Path("/sys/class/net").glob("*/type")):
        if _line(kind) == CAN_DEVICE:
            yield kind.parent.name, _line(kind.parent / "operstate")


def _real_time() -> Iterator[Check]:
    rights = f"as root, in {LIMITS_FILE}, then log in again:"
    if os.geteuid() == 0 or _limit("RLIMIT_RTPRIO") >= PRIORITY:
        yield Check("real-time scheduling", "ok", f"SCHED_FIFO, priority {PRIORITY}")
    else:
        found = f"priority {PRIORITY} is not allowed; at most {_limit('RLIMIT_RTPRIO'):g}"
        yield Check("real-time scheduling", "warning", found, f"{rights} * - rtprio {PRIORITY}")
    locked = _limit("RLIMIT_MEMLOCK")
    if os.geteuid() == 0 or locked == float("inf"):
        yield Check("locked memory", "ok", "unlimited")
    else:
        found = f"at most {locked / 2**20:.0f} MiB"
        yield Check("locked memory", "warning", found, f"{rights} * - memlock unlimited")
    yield _processors()
    if (governor := _line(Path("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor"))) not in (
        "",
        "performance",
    ):
        remedy = "sudo cpupower frequency-set --governor performance"
        yield Check("processor frequency", "warning", f"governor {governor}", remedy)
    kernel = "PREEMPT_RT" if _line(Path("/sys/kernel/realtime")) == "1" else "not PREEMPT_RT"
    yield Check("kernel", "ok" if kernel == "PREEMPT_RT" else "note", kernel)


def _processors() -> Check:
    if one_processor():
        remedy = "give the bench two processors or more"
        return Check("processors", "warning", "1: loop and listeners share it", remedy)
    return Check("processors", "ok", str(os.cpu_count()))


def _limit(name: str) -> float:
    """Return the soft limit of a resource, infinite where there is none, 0 where it is unknown."""
    number = getattr(resource, name, None)
    if number is None:
        return 0.0
    soft = resource.getrlimit(number)[0]
    return float("inf") if soft == resource.RLIM_INFINITY else float(soft)


def _files() -> Iterator[Check]:
    files = _limit("RLIMIT_NOFILE")
    enough = files >= LEAST_FILES
    yield Check(
        "open files",
        "ok" if enough else "warning",
        f"at most {files:g}",
        "" if enough else f"ulimit -n {LEAST_FILES}",
    )
    free = shutil.disk_usage(Path()).free
    yield Check(
        "disk space here",
        "ok" if free >= LEAST_SPACE else "warning",
        f"{free / 1e9:.1f} GB",
        "" if free >= LEAST_SPACE else "free 1 GB, or start the trial in another folder",
    )
    yield _cache()


def _cache() -> Check:
    try:
        folder = cache_folder()
    except OSError as cause:
        remedy = "set SLIPBENCH_CACHE to a folder that can be written"
        return Check("compiled kernels", "error", str(cause), remedy)
    if os.access(folder, os.W_OK):
        return Check("compiled kernels", "ok", str(folder))
    remedy = f"set SLIPBENCH_CACHE to a folder that {os.environ.get('USER', 'you')} can write"
    return Check("compiled kernels", "error", f"{folder} cannot be written", remedy)


def _line(path: Path) -> str:
    """Return the text of a file of /sys, empty where there is none."""
    with suppress(OSError):
        return path.read_text(encoding="ascii", errors="replace").strip()
    return ""
