"""A reference governor: which share of a requested slip the loop gets, and how fast.

It holds the reference inside what the tyre can carry and what the actuator can still give: where
the command stands at a limit, a reference that asks for more of the same would only wind the loop
up, so the reference stops where it is (Gilbert, Kolmanovsky and Tan 1995, in its simplest, scalar
form: r moves towards the target by the greatest share that keeps the predicted command allowed).
"""

from dataclasses import dataclass

from slipbench.controllers.limits import Range


@dataclass(frozen=True, slots=True)
class Governor:
    """slip: range and rate of the reference; gain: slip per unit of command, at low frequency;
    command: range of the actuator, in which the predicted command must stay."""

    slip: Range
    gain: float
    command: Range

    def __post_init__(self) -> None:
        """Raise ValueError for a gain of zero: nothing could be predicted."""
        if self.gain == 0.0:
            raise ValueError("the governor needs the gain from command to slip, not 0")

    def update(self, last: float, target: float, command: float, dt: float) -> float:
        """The next reference. last: the one before; command: the actuator's now.

        The step r - last will ask for (r - last) / gain beyond the present command.
        """
        requested = self.slip.towards(target, last, dt)
        predicted = command + (requested - last) / self.gain
        inside = self.command.nearest(predicted)
        least, most = sorted((last, requested))  # rounding must not lead out of the range
        return min(max(last + (inside - command) * self.gain, least), most)
