"""A kernel with CAN, or the reason why these tests cannot run here."""

import os

import pytest

from tests.socketcan.kernels import Kernel, usable


@pytest.fixture(scope="session")
def kernel() -> Kernel:
    found = usable()
    if isinstance(found, str):
        if os.environ.get("SLIPBENCH_REQUIRE_SOCKETCAN"):
            pytest.fail(f"no kernel with CAN: {found}")
        pytest.skip(f"no kernel with CAN: {found}")
    return found
