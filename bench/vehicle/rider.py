"""The scripted rider: holds the grip, presses the button, lets go when the bench is done."""

from slipbench.protocol.codec.messages import Phase, RiderControls
from slipbench.protocol.trial_file import VirtualRider

AFTER = frozenset({Phase.DONE, Phase.TRIPPED})


class Rider:
    """Looks at the dashboard (the trial's phase) and moves as the trial file says."""

    def __init__(self, script: VirtualRider, grip: float) -> None:
        """Hold `grip` (0..1) until told otherwise."""
        self._script = script
        self._armed_at: float | None = None
        self._pressed_at: float | None = None
        self._phase = Phase.IDLE
        self.grip = grip

    def sees(self, phase: Phase, now: float) -> None:
        """Read the dashboard at `now` (s)."""
        if phase == Phase.ARMED and self._phase != Phase.ARMED:
            self._armed_at = now
        self._phase = phase

    def controls(self, now: float) -> RiderControls:
        """Tell where the controls are at `now` (s)."""
        return RiderControls(self._presses(now), self.grip, 0.0, 0.0, 0.0)

    @property
    def pressed(self) -> bool:
        """Tell whether the button was pressed, now or before."""
        return self._pressed_at is not None

    def _presses(self, now: float) -> bool:
        if self._armed_at is None or now < self._armed_at + self._script.presses_button_after:
            return False
        if self._pressed_at is None:
            self._pressed_at = now
        if self._phase in AFTER:
            return False
        holds = self._script.holds_button_for
        return holds is None or now < self._pressed_at + holds
