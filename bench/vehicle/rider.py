"""Simulated rider: holds the grip, presses the button and releases it when the trial has ended."""

from slipbench.protocol.codec.messages import Authority, Phase, RiderControls
from slipbench.protocol.trial_file import VirtualRider

STEADY = 2.0  # s of steady riding before a trial that no dashboard shows
AFTER = frozenset({Phase.DONE, Phase.TRIPPED})


class Rider:
    """Controls of the rider, from the phase of the trial and the script of the trial file."""

    def __init__(self, script: VirtualRider, grip: float) -> None:
        """Start with the throttle grip at `grip` (0..1) and the button released."""
        self._script = script
        self._armed_at: float | None = None
        self._pressed_at: float | None = None
        self._phase = Phase.IDLE
        self.grip = grip
        self.clutch = 0.0  # 0 released .. 1 pulled

    def read_phase(self, phase: Phase, now: float) -> None:
        """Read the phase of the trial from the dashboard at `now` (s)."""
        if phase == Phase.ARMED and self._phase != Phase.ARMED:
            self._armed_at = now
        self._phase = phase

    def watch(self, authority: Authority, now: float) -> None:
        """Follow a trial that no dashboard shows at `now` (s), by the authority of the bench.

        The rider presses after a while of steady riding, and lets go once the bench has given back.
        """
        if self._phase == Phase.IDLE and now >= STEADY:
            self.read_phase(Phase.ARMED, now)
        elif authority != Authority.NONE:
            self._phase = Phase.EXCITING
        elif self._phase == Phase.EXCITING:
            self._phase = Phase.DONE

    def controls(self, now: float) -> RiderControls:
        """Positions of the controls at `now` (s)."""
        return RiderControls(self._presses(now), self.grip, 0.0, 0.0, self.clutch)

    def follow(self, controls: RiderControls, now: float) -> None:
        """Follow the controls of a real rider at `now` (s) instead of the script."""
        self.grip, self.clutch = controls.grip, controls.clutch
        if controls.button and self._pressed_at is None:
            self._pressed_at = now

    @property
    def pressed(self) -> bool:
        """Whether the button is or was pressed."""
        return self._pressed_at is not None

    def _presses(self, now: float) -> bool:
        """Whether the rider holds the button at `now` (s)."""
        if self._armed_at is None or now < self._armed_at + self._script.presses_button_after:
            return False
        if self._pressed_at is None:
            self._pressed_at = now
        if self._phase in AFTER:
            return False
        holds = self._script.holds_button_for
        return holds is None or now < self._pressed_at + holds
