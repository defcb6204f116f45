"""Two tanks, one overflowing into the other: known truth from an independent integrator."""

from pathlib import Path

import numpy as np

from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import RoleMap, Source

PERIOD = 4.0  # s
FINER = 40
PUMP, UPPER, INLET, LOWER = 0.04, 0.055, 0.06, 0.05
FULL, SHARE = 9.0, 0.4
ROLES = RoleMap(
    title="tanks",
    quantities={"pump_voltage": "V", "lower_level": "V"},
    roles={r: Source(column=r) for r in ("pump_voltage", "lower_level")},
)


def filled(seed: int, count: int = 500, bend: float = 0.0, noise: float = 0.01) -> Recording:
    """Record the lower level. bend: of its sensor, 1/V; count: samples."""
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    time = PERIOD * np.arange(count)
    voltage = np.repeat(rng.uniform(0.5, 7.0, count // 10 + 1), 10)[:count]
    upper, lower, level = 5.0, 5.0, np.empty(count)
    h = PERIOD / FINER
    for k, u in enumerate(voltage):
        level[k] = lower
        for _ in range(FINER):
            out = np.sqrt(max(upper, 0.0))
            upper += h * (PUMP * u - UPPER * out)
            over, upper = max(upper - FULL, 0.0), min(upper, FULL)
            lower += h * (INLET * out - LOWER * np.sqrt(max(lower, 0.0))) + SHARE * over
            lower = min(lower, FULL)
    columns = {"pump_voltage": voltage}
    columns["lower_level"] = level + bend * (level - 5.0) ** 2 + noise * rng.standard_normal(count)
    channels = {r: Channel(r, time, y, "V", "bus", "made") for r, y in columns.items()}
    return Recording(Path(f"tanks{seed}"), {}, None, ROLES, channels, {})
