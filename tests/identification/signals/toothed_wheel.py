"""A toothed wheel with known speed and gaps. It imitates no frames, no clocks, no vehicle."""

import numpy as np


def tooth_times(t, speed, gaps, timer=1e-6, start=0):
    """Times and running counts. t: s, equally spaced; speed: rad/s; gaps: (N,), sum 0."""
    teeth = gaps.size
    step = t[1] - t[0]
    angle = np.concatenate(([0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 * step)))
    edges = np.concatenate(([0.0], np.cumsum(1 + gaps))) / teeth  # of one turn, in turns
    turns = int(angle[-1] / (2 * np.pi)) + 1
    stands = (np.arange(turns)[:, None] + edges[None, :-1]).ravel() * 2 * np.pi
    stands = stands[(stands > angle[0]) & (stands < angle[-1])]
    time = np.interp(stands, angle, t)
    if timer:
        time = np.floor(time / timer) * timer
    return time, np.arange(1.0, time.size + 1) + start


def random_gaps(rng, teeth, size=0.02):
    gaps = rng.normal(0, size, teeth)
    return gaps - gaps.mean()


def coloured(rng, n, rate, size, corner):
    """Noise of the wheel's motion, first-order, of a deviation `size`."""
    from scipy import signal

    white = rng.standard_normal(n)
    a = np.exp(-2 * np.pi * corner / rate)
    return size * np.sqrt(1 - a**2) * signal.lfilter([1.0], [1.0, -a], white)
