"""The tests that need a real vcan, run where there is one."""

from collections.abc import Callable

import pytest

from tests.socketcan import box
from tests.socketcan.kernels import Kernel


@pytest.mark.parametrize(("path", "limit"), [
    ("tests/bus", 300.0),
    ("tests/socketcan/inside/test_sockets.py", 200.0),
])  # fmt: skip
def test_on_a_real_vcan(
    kernel: Kernel, path: str, limit: float, record_property: Callable[[str, object], None]
) -> None:
    found = box.test(kernel, [path], limit)
    record_property("inside", f"{path} on vcan0, {kernel.name}: {found.closing_line}")
    report = f"{found.ended.output}\n{found.ended.console}"
    assert found.ended.status == 0, report
    assert found.tests > 0, report
    assert found.skipped == 0, report
