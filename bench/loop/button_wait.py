"""Wait for the next tick that ends early when the button is pressed while the bench is armed.

A press can arrive at any time between two ticks. Without this, it would wait for the next tick, up to
1 ms. Instead the next tick is due at once, and later ticks one period apart from it.
See `bench.loop.loop.run_periodic`.
"""

import select
from collections.abc import Sequence

import can

from slipbench.bench.gateway.gateway import Gateway
from slipbench.bench.loop.clock import SPIN, Clock
from slipbench.bench.loop.loop import Wait


def button_wait(gateway: Gateway, buses: Sequence[can.BusABC], clock: Clock) -> Wait | None:
    """Wait function for `run_periodic`; None where a bus has no file descriptor to wait on.

    python-can's `virtual` interface has none.
    """
    try:
        numbers = [bus.fileno() for bus in buses]
    except NotImplementedError:
        return None

    def wait(deadline: int) -> bool:
        while gateway.expects_the_button and (remaining := deadline - clock.now_ns()) > SPIN:
            if gateway.attend(min(clock.now_ns(), deadline)):
                return True
            if not select.select(numbers, [], [], (remaining - SPIN) * 1e-9)[0]:
                break
        clock.sleep_until_ns(deadline)
        return False

    return wait
