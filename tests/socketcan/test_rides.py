"""`make vcan`: trials, slip control, a killed bench and a replay on a real vcan: minutes.

A kernel in user mode has a process of the machine for each of its own, and switches between them
slowly; so these run beside `make test`, not in it.
"""

from collections.abc import Callable

import pytest

from tests.recordings import recording
from tests.socketcan.inside_a_kernel import passes_inside
from tests.socketcan.kernels import Kernel


@pytest.mark.parametrize(
    "path",
    [
        "tests/socketcan/inside/test_trial.py tests/socketcan/inside/test_slip_control.py",
        "tests/socketcan/inside/test_killed_bench.py",
        "tests/socketcan/inside/test_replay.py",
    ],
)
def test_rides_on_a_real_vcan(
    kernel: Kernel, path: str, record_property: Callable[[str, object], None]
) -> None:
    if path.endswith("test_replay.py"):
        recording("subaru_wrx/can_sample.log")
    passes_inside(kernel, path, record_property)
