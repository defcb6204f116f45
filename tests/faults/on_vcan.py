"""`python -m tests.faults.on_vcan`: real processes, real signals and the CAN bus of a real kernel.

Some 110 s of processor time on user-mode Linux, so CI runs it beside `make test`, not in it.
"""

import os
import sys

from tests.faults.matrix import INSIDE
from tests.socketcan import box
from tests.socketcan.kernels import usable

LIMIT = 140.0  # s of the kernel's own time


def main() -> None:
    """Run the tests and print the result. Without a kernel that has CAN, this fails in CI only."""
    kernel = usable()
    if isinstance(kernel, str):
        print(f"not run: no kernel with CAN: {kernel}")
        sys.exit(1 if os.environ.get("SLIPBENCH_REQUIRE_SOCKETCAN") else 0)
    found = box.run_tests(kernel, [f"{INSIDE}/test_faults.py"], LIMIT)
    print(f"faults on vcan0, {kernel.name}: {found.closing_line}")
    if found.ended.status != 0:
        sys.exit(f"{found.ended.output}\n{found.ended.console}")


if __name__ == "__main__":
    main()
