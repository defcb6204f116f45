"""Two motors, a belt and a counter blind to direction, by transfer functions in closed form.

The known truth behind tests that ask whether a nominal model with a rigid belt and a counter that
detects direction is corrected. Equations and integrator do not use the model file: the belt is a
mode in series, G(s) = gain w^2 / ((T s + 1) (s^2 + 2 z w s + w^2)), made discrete exactly.
"""

from pathlib import Path

import numpy as np
from scipy import signal

from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import RoleMap, Source

PERIOD = 0.02  # s
FREQUENCY, DAMPING = 20.0, 0.15  # rad/s, 1
ROLES = RoleMap(
    title="drives",
    quantities={"motor_voltage": "V", "pulley_speed": "V"},
    roles={r: Source(column=r) for r in ("motor_voltage", "pulley_speed")},
)


def recorded(
    seed: int,
    blind: bool = True,
    belt: bool = True,
    gain: float = 1.8,
    lag: float = 0.35,
    seconds: float = 10.0,
    noise: float = 0.02,
) -> Recording:
    """Ride through noise of 1 V, held for 0.1 s. Nominal: gain 1.5, lag 0.5 s."""
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    time = PERIOD * np.arange(round(seconds / PERIOD))
    voltage = np.repeat(rng.uniform(-1.7, 1.7, time.size // 5 + 1), 5)[: time.size]
    below = [lag, 1.0]
    above = [gain]
    if belt:
        above = [gain * FREQUENCY**2]
        below = list(np.polymul(below, [1.0, 2 * DAMPING * FREQUENCY, FREQUENCY**2]))
    discrete = signal.cont2discrete((above, below), PERIOD)
    speed = signal.lfilter(discrete[0].ravel(), discrete[1], voltage)
    shown = np.abs(speed) if blind else speed
    values = {
        "motor_voltage": voltage,
        "pulley_speed": shown + noise * rng.standard_normal(time.size),
    }
    channels = {r: Channel(r, time, v, ROLES.unit(r), "bus", "made") for r, v in values.items()}
    return Recording(Path(f"drives{seed}"), {}, None, ROLES, channels, {})
