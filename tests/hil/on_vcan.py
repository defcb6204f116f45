"""`make hil`: the program of the device on a real vcan, against the vehicle and the gateway: minutes.

Not part of `make test`, as the rides of tests/socketcan/test_rides.py are not.
"""

import os
from collections.abc import Callable

import pytest

from tests.socketcan import box
from tests.socketcan.kernels import usable

LIMIT = 75.0  # s of the kernel's own time


@pytest.mark.parametrize(
    "file", ["test_program.py", "test_ride.py", "test_faults.py", "test_how_to.py"]
)
def test_the_device_on_a_real_vcan(
    file: str, record_property: Callable[[str, object], None]
) -> None:
    kernel = usable()
    if isinstance(kernel, str):
        if os.environ.get("SLIPBENCH_REQUIRE_SOCKETCAN"):
            pytest.fail(f"no kernel with CAN: {kernel}")
        pytest.skip(f"no kernel with CAN: {kernel}")
    found = box.run_tests(kernel, [f"tests/hil/inside/{file}", "-rP"], LIMIT)
    record_property("inside", f"{file} on vcan0, {kernel.name}: {found.closing_line}")
    for line in found.ended.output.splitlines():
        if line.startswith("granted until"):
            record_property("inside", f"{file} on vcan0: {line}")
    report = f"{found.ended.output}\n{found.ended.console}"
    assert found.ended.status == 0, report
    assert found.tests > 0, report
    assert found.skipped == 0, report
