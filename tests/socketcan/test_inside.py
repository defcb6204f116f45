"""The tests that need a real vcan, run where there is one; whole rides are in test_rides.py."""

from collections.abc import Callable

import pytest

from tests.bench.testing.conftest import plugin_options
from tests.socketcan.inside_a_kernel import passes_inside
from tests.socketcan.kernels import Kernel


@pytest.mark.parametrize(
    "path",
    [
        "tests/bench/bus/test_laws.py tests/bench/bus/test_load.py",
        "tests/socketcan/inside/test_sockets.py",
    ],
)
def test_on_a_real_vcan(
    kernel: Kernel, path: str, record_property: Callable[[str, object], None]
) -> None:
    passes_inside(kernel, path, record_property)


def test_the_example_suite_passes_on_a_real_vcan(
    kernel: Kernel, record_property: Callable[[str, object], None]
) -> None:
    options = (
        "--slipbench-clock real-time --slipbench-interface socketcan --slipbench-channel vcan0"
    )
    command = ["examples/hil_tests", "-o", "addopts=", *options.split(), *plugin_options()]
    passes_inside(kernel, " ".join(command), record_property)
