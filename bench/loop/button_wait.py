"""The wait for the next tick; while the bench is armed it listens for the button meanwhile.

A press arrives anywhere between two ticks. Were it to wait for the next one, a period of 1 ms would
go by in the worst case; instead the ticks begin anew with it.
See `bench.loop.loop.run_periodic`.
"""

import select

import can

from slipbench.bench.gateway.gateway import Gateway
from slipbench.bench.loop.clock import SPIN, Clock
from slipbench.bench.loop.loop import Wait


def button_wait(gateway: Gateway, bus: can.BusABC, clock: Clock) -> Wait | None:
    """Make the wait; None where the interface has nothing to wait on (python-can's `virtual`)."""
    try:
        number = bus.fileno()
    except NotImplementedError:
        return None

    def wait(deadline: int) -> bool:
        while gateway.expects_the_button and (left := deadline - clock.now_ns()) > SPIN:
            if gateway.attend(min(clock.now_ns(), deadline)):
                return True
            if not select.select([number], [], [], (left - SPIN) * 1e-9)[0]:
                break
        clock.sleep_until_ns(deadline)
        return False

    return wait
