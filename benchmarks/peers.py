"""Comparison with PyPI packages for the step from samples to a model.

`python benchmarks/peers.py [seeds] [--out docs/peers.md]` simulates trials of the linear
motorcycle; errors and times of all packages are from the same samples.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from known.estimates import arx, curve_fit, jax_sysid, n4sid, slipbench, sysidentpy, welch, whole
from rides import RATE, Ride, driveline, linear, ride, still_speed, truth

LASTS = 30.0  # s


@dataclass(frozen=True)
class Peer:
    """A method from samples to a model. package: required package; empty for slipbench and scipy."""

    name: str
    package: str
    estimate: Callable[[Ride, np.ndarray], tuple[np.ndarray, float]]


def from_samples(estimate):
    """Apply the method to throttle and slip of a trial."""
    return lambda one, f: estimate(one.throttle, one.slip, RATE, f)


PEERS = (
    Peer("slipbench, with both speeds", "", whole),
    Peer("slipbench", "", from_samples(slipbench)),
    Peer("python-control, ARX", "control", from_samples(arx)),
    Peer("scipy csd / welch", "scipy", from_samples(welch)),
    Peer("scipy least_squares on welch", "scipy", from_samples(curve_fit)),
    Peer("nfoursid, 6 states", "nfoursid", from_samples(n4sid)),
    Peer("sysidentpy, ARX by FROLS", "sysidentpy", from_samples(sysidentpy)),
    Peer("jax-sysid, 6 states", "jax_sysid", from_samples(jax_sysid)),
)
SEEDS, FIRST = 3, 310_000
AT = np.linspace(1.0, 11.5, 40)  # Hz


@dataclass(frozen=True)
class Judged:
    """Errors over all trials: gain (median, greatest, %), phase (greatest, degrees), resonance (%).

    took: s a ride, the first left out where there are more: what is compiled is compiled then
    """

    gain: float
    worst: float
    phase: float
    resonance: float
    took: float


def judged(estimate, rides: list[Ride], motorcycle) -> Judged:
    """Errors of a method against the truth at the speed of each trial."""
    still = still_speed(motorcycle, LASTS)
    gain, phase, off, took = [], [], [], []
    for one in rides:
        begun = time.perf_counter()
        value, resonance = estimate(one, AT)
        took.append(time.perf_counter() - begun)
        ratio = value / truth(motorcycle)(AT, one.speed - still)
        gain.append(100 * np.abs(np.abs(ratio) - 1))
        phase.append(np.degrees(np.abs(np.angle(ratio))))
        off.append(100 * abs(resonance / driveline(motorcycle, one.speed - still)[0] - 1))
    return Judged(
        float(np.median(gain)),
        float(np.max(gain)),
        float(np.max(phase)),
        float(np.median(off)),
        float(np.median(took[1:] or took)),
    )


HEAD = (
    "",
    "version",
    "gain p50, %",
    "gain max, %",
    "phase max, °",
    "resonance p50, %",
    "s",
    "times ours",
)


def rows(seeds: int) -> list[tuple[str, ...]]:
    """Rows of the table; a package that is absent or fails is listed with the reason."""
    motorcycle = linear("demonstration")
    rides = [ride(motorcycle, 1.0, FIRST + k, LASTS) for k in range(seeds)]
    made, ours = [], None
    for peer in PEERS:
        if peer.package and find_spec(peer.package) is None:
            made.append((peer.name, "absent (benchmarks/peers.txt)", *("–",) * 6))
            continue
        held = version(peer.package.replace("_", "-")) if peer.package else "this one"
        try:
            of = judged(peer.estimate, rides, motorcycle)
        except Exception as fault:  # a peer's own trouble is its row of the table
            made.append((peer.name, held, f"{type(fault).__name__}: {fault}"[:60], *("–",) * 5))
            continue
        ours = ours or of.took
        made.append(
            (
                peer.name,
                held,
                f"{of.gain:.2f}",
                f"{of.worst:.2f}",
                f"{of.phase:.2f}",
                f"{of.resonance:.2f}",
                f"{of.took:.2f}",
                f"{of.took / ours:.1f}",
            )
        )
    return made


def page(seeds: int) -> str:
    """The page as Markdown."""
    lines = [HEAD, tuple("---" for _ in HEAD), *rows(seeds)]
    table = "\n".join("| " + " | ".join(line) + " |" for line in lines)
    return (
        "# From samples to a model, beside other packages\n\n"
        f"Written by `make peers` (`benchmarks/peers.py`). {seeds} simulated trials of the linear "
        f"demonstration motorcycle, sweeps of {LASTS:g} s, noise 1, seeds from {FIRST} on; errors "
        "of the frequency response to the throttle from 1 to 11.5 Hz and of the driveline "
        "resonance. Every package gets throttle and slip; the first row, as in a report, also uses "
        "the two speeds from which slip is computed. State-space and ARX packages get data at 100 "
        "Hz with the mean removed, and 6 states or lags, which a user would have to choose; "
        "slipbench selects its order, and is the only one that states an uncertainty.\n\n"
        f"{table}\n"
    )


def main() -> None:
    """Print the page or write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seeds", type=int, nargs="?", default=SEEDS)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    made = page(given.seeds)
    if given.out is None:
        print(made)
    else:
        given.out.write_text(made, encoding="utf-8")


if __name__ == "__main__":
    main()
