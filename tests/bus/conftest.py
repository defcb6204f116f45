"""Every law of a bus is tried on every wire there is."""

from collections.abc import Iterator

import pytest

from tests.bus.wires import FD_WIRES, WIRES, Wire


@pytest.fixture(params=sorted(WIRES))
def wire(request: pytest.FixtureRequest) -> Iterator[Wire]:
    with WIRES[request.param]() as wire:
        yield wire


@pytest.fixture(params=sorted(FD_WIRES))
def fd_wire(request: pytest.FixtureRequest) -> Iterator[Wire]:
    """A wire that also carries CAN FD; the simulated one does not."""
    with FD_WIRES[request.param]() as wire:
        yield wire
