"""Every law of a bus is tested on every kind of bus."""

from collections.abc import Iterator

import pytest

from tests.bench.bus.wires import WIRES, Wire


@pytest.fixture(params=sorted(WIRES))
def wire(request: pytest.FixtureRequest) -> Iterator[Wire]:
    with WIRES[request.param]() as wire:
        yield wire
