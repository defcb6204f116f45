"""The tests that need a real vcan, run where there is one."""

from collections.abc import Callable

import pytest

from tests.socketcan import box
from tests.socketcan.kernels import Kernel


@pytest.mark.parametrize(("path", "limit", "slow"), [
    ("tests/bus", 120.0, 1),
    ("tests/socketcan/inside/test_sockets.py", 120.0, 1),
    ("tests/socketcan/inside/test_trial.py", 30.0, 12),
    ("tests/socketcan/inside/test_killed_bench.py", 30.0, 12),
])  # fmt: skip
def test_on_a_real_vcan(
    kernel: Kernel,
    path: str,
    limit: float,
    slow: int,
    record_property: Callable[[str, object], None],
) -> None:
    found = box.run_tests(kernel, [path], limit, slow)
    record_property("inside", f"{path} on vcan0, {kernel.name}: {found.closing_line}")
    report = f"{found.ended.output}\n{found.ended.console}"
    assert found.ended.status == 0, report
    assert found.tests > 0, report
    assert found.skipped == 0, report
