"""Time and memory of `slipbench explain` by the length of the recording, for a mass on a spring.

`python -m benchmarks.long_recordings [samples ...]` prints one table. The recording is simulated, with
a hidden hardening of the spring and with nothing hidden. Each analysis has a process of its own and
compiled code from the cache. Columns: processor time of each step, s; of all; the most memory that the
process had.
"""

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from numba import njit

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.explain import NAMES, analyse
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.plant.signals import Floats
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import RoleMap, Source

SAMPLES = (10_000, 100_000)
PERIOD = 0.01  # s
FINER = 4
GAIN, FREQUENCY, DAMPING, CUBE = 97.0, 10.3, 0.11, 0.5
NOISE = 2e-3  # m
MODEL = """
name = "Mass on a spring"
step = "5 ms"
period = "10 ms"
stretch = "1 s"

[parameters]
gain = { value = 100, unit = "N/kg/V", plus_minus = 20 }
frequency = { value = 10, unit = "rad/s", plus_minus = 1 }
damping = { value = 0.1, unit = "1", plus_minus = 0.05 }

[inputs.force]
role = "force"
size = { value = 1, unit = "V" }

[states.position]
rate = "velocity"
size = { value = 1, unit = "m" }

[states.velocity]
rate = "gain * force - frequency ** 2 * deflection - 2 * damping * frequency * velocity"
size = { value = 10, unit = "m/s" }

[seams.deflection]
value = "position"
size = { value = 1, unit = "m" }
along = "velocity"

[outputs.place]
role = "place"
value = "position"
size = { value = 1, unit = "m" }
"""
ROLES = RoleMap(
    title="spring",
    quantities={"force": "V", "place": "m"},
    roles={r: Source(column=r) for r in ("force", "place")},
)


@njit(cache=True)
def swung(force: Floats, cube: float) -> Floats:
    """Position at each sample, m: explicit midpoint rule in quarters of a period. cube: 1/m^2."""
    x = v = 0.0
    h = PERIOD / FINER
    shown = np.empty(force.size)
    for k in range(force.size):
        shown[k] = x
        for _ in range(FINER):
            a = GAIN * force[k] - FREQUENCY**2 * (x + cube * x**3) - 2 * DAMPING * FREQUENCY * v
            y, w = x + 0.5 * h * v, v + 0.5 * h * a
            x += h * w
            v += h * (
                GAIN * force[k] - FREQUENCY**2 * (y + cube * y**3) - 2 * DAMPING * FREQUENCY * w
            )
    return shown


def recording(samples: int, cube: float, seed: int = 1) -> Recording:
    """Simulate a recording; the force changes ten times a second."""
    rng = np.random.default_rng(seed)
    force = np.repeat(rng.standard_normal(samples // 10 + 1), 10)[:samples]
    place = swung(force, cube) + NOISE * rng.standard_normal(samples)
    moments = PERIOD * np.arange(samples)
    values = {"force": force, "place": place}
    channels = {r: Channel(r, moments, y, ROLES.unit(r), "bus", "made") for r, y in values.items()}
    return Recording(Path("spring"), {}, None, ROLES, channels, {})


def measure(samples: int, cube: float) -> None:
    """Print one line of the table: this process analyses one recording."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "spring.toml"
        path.write_text(MODEL, encoding="utf-8")
        system = ModelSystem.load(path)
    made = recording(samples, cube)
    begun = time.process_time()
    analysis = begin(system, [system.prepare(made)], [])
    marks = [begun, time.process_time()]
    for number in range(1, len(NAMES) + 1):
        analyse(analysis, until=number)
        marks.append(time.process_time())
    spent = "".join(f"{t:9.1f}" for t in np.diff(marks))
    most = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    names = "nothing" if analysis.named is None else " + ".join(analysis.named.names) or "nothing"
    print(f"{spent}{marks[-1] - begun:9.1f}{most:9.0f}  {names}", flush=True)


def main(arguments: list[str]) -> None:
    """Print the table; with `--one SAMPLES CUBE` one line of it."""
    if arguments[:1] == ["--one"]:
        measure(int(arguments[1]), float(arguments[2]))
        return
    print(
        f"{'samples':>9} hidden  {'reading':>9}"
        + "".join(f"{n[:8]:>9}" for n in NAMES)
        + "      all       MB  named"
    )
    for samples in map(int, arguments) if arguments else SAMPLES:
        for cube in (CUBE, 0.0):
            print(f"{samples:9d} {'cube' if cube else 'none':6s}  ", end="", flush=True)
            command = [
                sys.executable,
                "-m",
                "benchmarks.long_recordings",
                "--one",
                str(samples),
                str(cube),
            ]
            subprocess.run(command, check=True)


if __name__ == "__main__":
    main(sys.argv[1:])
