"""A set of test files run inside a kernel of its own, where there is a real vcan."""

from collections.abc import Callable

from tests.socketcan import box
from tests.socketcan.kernels import Kernel

LIMIT = 20.0  # s of the kernel's own time


def passes_inside(
    kernel: Kernel, path: str, record_property: Callable[[str, object], None]
) -> None:
    """Run the files; fail with all that was said unless each of their tests ran and passed."""
    found = box.run_tests(kernel, path.split(), LIMIT)
    record_property("inside", f"{path} on vcan0, {kernel.name}: {found.closing_line}")
    report = f"{found.ended.output}\n{found.ended.console}"
    assert found.ended.status == 0, report
    assert found.tests > 0, report
    assert found.skipped == 0, report
