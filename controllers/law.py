"""Interface of every control law: an explicit state, a start without a jump, and an update.

    state = law.start(command, reference, measurement)      # as if it had always given `command`
    command, state = law.update(state, reference, measurement, dt)

A law is frozen and knows no time; whoever calls it keeps the state. A measurement that is NaN
(nothing is known) freezes the state and holds the last command.
"""

from typing import Protocol, TypeVar

from slipbench.controllers.limits import Range

State = TypeVar("State")


class Law(Protocol[State]):
    """One command from one reference and one measurement, all in SI.

    The command lies within the law's limits, and moves no faster than they allow.
    """

    @property
    def limits(self) -> Range:
        """Bounds of the command."""
        ...

    def start(self, command: float, reference: float, measurement: float) -> State:
        """Take over at `command` without a jump."""
        ...

    def update(
        self, state: State, reference: float, measurement: float, dt: float
    ) -> tuple[float, State]:
        """The command for the next `dt` seconds, and the state after it."""
        ...

    def given(self, state: State, command: float, dt: float) -> State:
        """State after the actuators gave only a part of the last command."""
        ...
