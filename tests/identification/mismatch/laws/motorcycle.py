"""Short rides of a motorcycle with known truth, and changes of its channels."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.reporting.verdict import Verdict
from slipbench.plant.effects.effect import Effect
from slipbench.protocol.recording.recording import Recording
from tests.identification.mismatch.conditions import erring, system
from tests.identification.mismatch.laws.explained import explained
from tests.identification.motorcycle_recording import Ride, ride

LEARN = (
    Ride("multisine", 3, 1050.0, 0.035, 0.6, 14.0, seconds=6.0, seed=31),
    Ride("square", 2, 1150.0, 0.06, 0.9, seconds=6.0, seed=32),
)
PROVE = (Ride("sweep", 2, 1250.0, 0.04, 0.5, 9.0, seconds=6.0, seed=33),)
Change = Callable[[Recording], Recording]


def same(recording: Recording) -> Recording:
    """Return the recording."""
    return recording


def ridden(
    *effects: Effect,
    library: tuple[str, ...],
    seed: int = 5,
    share: float = 0.6,
    change: Change = same,
    training: tuple[Ride, ...] = LEARN,
    held_out: tuple[Ride, ...] = PROVE,
) -> Verdict:
    """Verdict of rides of a motorcycle with these effects. share: as in `erring`."""
    print(f"seed {seed}")
    true = replace(erring(seed, share), effects=effects)
    records = ([change(ride(true, r)) for r in rides] for rides in (training, held_out))
    return explained(system(), *records, library)


def values(role: str, new: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Change:
    """Change of the values of a channel: a function of time and values."""

    def change(recording: Recording) -> Recording:
        channel = recording.channels[role]
        changed = replace(channel, value=new(channel.time, channel.value))
        return replace(recording, channels={**recording.channels, role: changed})

    return change


def late(role: str, by: float) -> Change:
    """A channel with a constant latency, s."""
    return values(role, lambda t, y: np.interp(t - by, t, y))


def lagging(role: str, time_constant: float) -> Change:
    """A channel behind a lag of first order. time_constant: s."""

    def lag(t: np.ndarray, y: np.ndarray) -> np.ndarray:
        keep = np.exp(-np.diff(t, prepend=t[0]) / time_constant)
        out = np.empty_like(y)
        last = y[0]
        for k, new in enumerate(y):
            last = keep[k] * last + (1.0 - keep[k]) * new
            out[k] = last
        return out

    return values(role, lag)


def averaged(role: str, window: float) -> Change:
    """A channel that averages over a window, s."""

    def mean(t: np.ndarray, y: np.ndarray) -> np.ndarray:
        fine = np.arange(t[0] - window, t[-1], 1e-4)
        kept = round(window / 1e-4)
        means = np.convolve(np.interp(fine, t, y), np.ones(kept) / kept)[: fine.size]
        return np.interp(t, fine[kept:], means[kept:])

    return values(role, mean)


def rounded(role: str, step: float) -> Change:
    """A channel with coarse quantization steps."""
    return values(role, lambda _, y: step * np.round(y / step))


def held(role: str, hold: float, jitter: float = 0.0, seed: int = 1) -> Change:
    """A channel that repeats the first frame after each update.

    hold, jitter: s between updates, and its deviation.
    """
    rng = np.random.default_rng(seed)

    def repeat(t: np.ndarray, y: np.ndarray) -> np.ndarray:
        between = hold + jitter * rng.standard_normal(round((t[-1] - t[0]) / hold) + 2)
        updates = t[0] + np.cumsum(np.maximum(between, 0.1 * hold))
        last = np.searchsorted(updates, t, "right") - 1
        fresh = np.diff(last, prepend=-1) != 0
        fresh[0] = True
        return np.asarray(y[np.maximum.accumulate(np.where(fresh, np.arange(y.size), 0))])

    return values(role, repeat)


def stale(role: str, share: float, seed: int = 1) -> Change:
    """A channel of which a share of the frames, drawn at random, repeats the one before."""
    rng = np.random.default_rng(seed)

    def repeat(_: np.ndarray, y: np.ndarray) -> np.ndarray:
        fresh = rng.random(y.size) >= share
        fresh[0] = True
        return np.asarray(y[np.maximum.accumulate(np.where(fresh, np.arange(y.size), 0))])

    return values(role, repeat)


def on_a_clock(role: str, drift: float, named: bool = True) -> Change:
    """A channel with a fast clock. drift: share; named: declared as device time, else bus time."""

    def change(recording: Recording) -> Recording:
        old = recording.channels[role]
        assert old.arrival is not None
        since = old.time if named else old.time + np.min(old.arrival - old.time)
        changed = replace(old, time=since[0] + (since - since[0]) * (1.0 + drift))
        if not named:
            changed = replace(changed, clock="bus", arrival=None)
        return replace(recording, channels={**recording.channels, role: changed})

    return change
