"""The shipped controllers, and slip for them."""

from pathlib import Path

import numpy as np

from slipbench.identification.ecu.replay import WheelSamples
from slipbench.protocol.configuration import read_toml
from slipbench.protocol.controller_file import ControllerFile, PidGains, ScheduledGains
from tests.paths import CONTROLLERS

TARGET = 0.03
SHIPPED = sorted(path.stem for path in CONTROLLERS.glob("*.toml"))


def shipped(name: str) -> ControllerFile:
    return read_toml(Path(CONTROLLERS) / f"{name}.toml", ControllerFile)


def scheduled() -> ControllerFile:
    """Make a PID whose gains follow the speed."""
    spark = shipped("spark")
    assert isinstance(spark.law, PidGains)
    rows = tuple(
        ScheduledGains(
            speed=v,
            gains=spark.law.model_copy(update={"proportional": p, "integral": i, "derivative": d}),
        )
        for v, p, i, d in (
            (20.0, 4.0, 900.0, 0.2),
            (45.0, 6.0, 2500.0, 0.6),
            (70.0, 7.0, 1500.0, 0.3),
        )
    )
    return spark.model_copy(update={"schedule": rows})


def drawn(seed: int, ticks: int = 600, gaps: bool = True) -> WheelSamples:
    """Draw slip about the target, with speeds from 10 to 80 m/s and, with gaps, sensors that fail."""
    rng = np.random.default_rng(seed)
    k = np.arange(ticks)
    slow, fast = rng.uniform(0.005, 0.03, 2), rng.uniform(0.05, 0.6, 2)
    slip = TARGET + 0.03 * np.sin(slow[0] * k) * np.sin(fast[0] * k)
    slip += 0.002 * rng.standard_normal(ticks)
    ratio = 1.0 + slip
    speed = 162.0 + 126.0 * np.sin(slow[1] * k)
    if gaps:
        for length in (3, 19, 40):
            first = int(rng.integers(ticks - length))
            ratio[first : first + length] = np.nan
        speed[int(rng.integers(ticks))] = np.nan
    return WheelSamples(ratio, speed)
