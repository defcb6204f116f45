"""The device in C, built once for each planted fault."""

from collections.abc import Callable
from functools import cache

import pytest

from tests.hil.device import Core, library, missing


@pytest.fixture(scope="session")
def core(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Core]:
    """Makes a device with a planted fault, or without ("")."""
    if why := missing():
        pytest.skip(f"the device under test is in C: {why}")
    folder = tmp_path_factory.mktemp("hil")
    loaded = cache(lambda planted: library(folder, planted))
    return lambda planted="": Core(loaded(planted))
