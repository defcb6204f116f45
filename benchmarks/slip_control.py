"""Processor time of slip control per tick: slip estimate and controller, for each controller.

`python benchmarks/slip_control.py [seconds]` runs each controller's trial on the simulated clock,
over CAN, and passes its frames to a new controller tick by tick, as the gateway does. Measured is the
processor time of this program without garbage collection, as in the loop's process. Limit: 100 us at
p99 of the ticks in control; other programs make it worse through the processor's caches.
"""

import gc
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from timing.quantiles import HEAD, Row

from slipbench.bench.gateway.slip_control import slip_control
from slipbench.bench.trials.preparation import Prepared, prepare
from slipbench.bench.trials.run import run_trial
from slipbench.bench.vehicle.virtual_motorcycle import wheels_of
from slipbench.dbc import MOTORBIKE
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.faults import FrameFault
from slipbench.protocol.logs import read_log

ROOT = Path(__file__).parents[1]
CONTROLLERS = ("throttle", "spark", "mixed")
LIMIT = 100e3  # ns, p99
PERIOD = 0.001  # s
HEARD = ("RearTeeth", "FrontTeeth", "OpticalSpeed")


def main(seconds: float = 20.0) -> None:
    """Print the table."""
    print(f"slip estimate and controller inside a tick, {seconds:g} s each\n{HEAD}")
    over = []
    for name in CONTROLLERS:
        learning, control = measure(name, seconds)
        print(Row(f"{name}: before the button", learning))
        print(Row(f"{name}: in control", control))
        over += [name] if np.percentile(control, 99) > LIMIT else []
    print(f"limit: p99 in control {LIMIT * 1e-3:g} us; over it: {', '.join(over) or 'none'}")
    sys.exit(bool(over))


def measure(name: str, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Processor time of each tick, ns: before the button, and while the controller acts."""
    with tempfile.TemporaryDirectory() as folder:
        prepared = prepare(lengthened(name, seconds, Path(folder)), MOTORBIKE)
        outcome = run_trial(prepared, Path(folder) / "run", None)
        assert outcome.done, outcome.trip
        begin, end = (
            next(c.time_ns for c in outcome.changes if c.phase.name == phase) * 1e-9
            for phase in ("EXCITING", "SETTLING")
        )
        return played(prepared, Path(folder) / "run" / "frames.log", begin, end)


def lengthened(name: str, seconds: float, folder: Path) -> Path:
    """A controller's own trial with another duration, s."""
    trials = ROOT / "trials"
    text = (trials / f"slip_steps_{name}.toml").read_text(encoding="utf-8")
    text = text.replace('duration = "8 s"', f'duration = "{seconds:g} s"')
    text = text.replace('"../', f'"{ROOT}/').replace('"controllers/', f'"{trials}/controllers/')
    path = folder / "trial.toml"
    path.write_text(text, encoding="utf-8")
    return path


def played(
    prepared: Prepared, log: Path, begin: float, end: float
) -> tuple[np.ndarray, np.ndarray]:
    """Pass the frames of a log to a new controller; `begin`, `end`: s, in which it acts."""
    codec = Codec(prepared.database)
    control = slip_control(prepared.plan, wheels_of(prepared.scenario.vehicle), codec)
    assert control is not None
    heard = messages(log, codec)
    gc.collect()
    gc.disable()  # as the loop's own process does
    base, k, spent = heard[0][0], 0, ([], [])
    for now in np.arange(base, end, PERIOD).tolist():
        arrived = []
        while k < len(heard) and heard[k][0] <= now:
            arrived.append(heard[k])
            k += 1
        began = time.thread_time_ns()
        for _, name, message in arrived:
            control.observe(name, message, now)
        if now >= begin:
            control.update(0.001 if int(now) % 2 else -0.001, now)
        spent[now >= begin].append(time.thread_time_ns() - began)
    gc.enable()
    return np.array(spent[0]), np.array(spent[1])


def messages(log: Path, codec: Codec) -> list[tuple[float, str, object]]:
    """Decoded messages that the controller reads: arrival (s), name, message."""
    frames = read_log(log).frames
    by_identifier = {codec.identifier(name): name for name in HEARD}
    found = []
    for time_ns, identifier, data, length in zip(
        frames.time_ns, frames.identifier, frames.data, frames.length, strict=True
    ):
        if (name := by_identifier.get(int(identifier))) is not None:
            message = codec.decode(int(identifier), data[:length].tobytes())
            assert not isinstance(message, FrameFault)
            found.append((int(time_ns) * 1e-9, name, message))
    return found


if __name__ == "__main__":
    main(*(float(argument) for argument in sys.argv[1:]))
