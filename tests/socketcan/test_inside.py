"""The tests that need a real vcan, run where there is one."""

from collections.abc import Callable

import pytest

from tests.recordings import recording
from tests.socketcan import box
from tests.socketcan.kernels import Kernel

LIMIT = 40.0  # s of the kernel's own time


@pytest.mark.parametrize("path", [
    "tests/bus/test_laws.py tests/bus/test_load.py",
    "tests/socketcan/inside/test_sockets.py",
    "tests/socketcan/inside/test_trial.py tests/socketcan/inside/test_slip_control.py",
    "tests/socketcan/inside/test_killed_bench.py",
    "tests/socketcan/inside/test_replay.py",
])  # fmt: skip
def test_on_a_real_vcan(
    kernel: Kernel, path: str, record_property: Callable[[str, object], None]
) -> None:
    if path.endswith("test_replay.py"):
        recording("subaru_wrx/can_sample.log")
    found = box.run_tests(kernel, path.split(), LIMIT)
    record_property("inside", f"{path} on vcan0, {kernel.name}: {found.closing_line}")
    report = f"{found.ended.output}\n{found.ended.console}"
    assert found.ended.status == 0, report
    assert found.tests > 0, report
    assert found.skipped == 0, report
