"""Along what a free curve acts: a quantity now, its past, its turning back, or as its scale.

Of the value now it is a broken line f(z) over knots of z. Of the past it is a broken line over the
lag: what a step of z has brought about so many seconds later, so that delays, lags and resonances
are all of one kind. Of turning back it is a sum of elements that follow z as far as their half
width allows and then slide: the stops of Prandtl and Ishlinskii (Brokate and Sprekels, "Hysteresis
and Phase Transitions" (1996), section 2.3), by which play and dry friction differ from any f(z).
As a scale it is f(z) x, a broken line over z by which another quantity x counts for more or less.
Of a turn of an angle it is what comes back at every turn: its first orders, without their mean,
since what is there all round is none of the angle's.

All of them are linear in their values, and are evaluated row by row of a simulation, since what
lasts some milliseconds or goes round with a wheel is not seen in the means of longer bins.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numba import njit

from slipbench.plant.signals import Floats

PAST = "past of "
HYSTERESIS = "hysteresis of "
SCALE = "scale of "
DETAIL = "detail of "
OVER = " along "
"""Between the quantity that is scaled and the one that tells by how much."""
TURN = "turn of "
ANGLE = TURN + "rear wheel"
LAGS = np.array((0.0, 0.005, 0.012, 0.03, 0.07, 0.15, 0.3, 0.6, 1.2, 2.4))
"""Seconds after a step."""
WIDTHS = np.array((0.0, 0.004, 0.012, 0.04, 0.12, 0.4))
"""Half widths in shares of the quantity's range; 0 stands for the quantity itself."""
KNOTS = 7
"""Of a broken line; of a turn evenly round, which tell its orders up to the third."""
FINE = 30
ROUNDS = (7, 15, 31)
"""Knots evenly round a turn once a curve is known to be there: orders up to the third, and so on."""
HALVED = {HYSTERESIS: 0, DETAIL: 2}
"""How often the distances of knots are halved once a curve is known to be there; else once."""
KINDS = (PAST, HYSTERESIS, SCALE, DETAIL, TURN)
ENDS = (0.002, 0.998)
"""Quantiles of a quantity that count as the ends of its range."""


def kind_of(regressor: str) -> str:
    """Return what a regressor begins with: one of KINDS, or nothing: the value now.

    Knots are lags (s) of a past, half widths (in the quantity's unit) of a hysteresis, else values
    of the quantity; of its detail many; of a turn angles evenly round it. The course of a scale is
    two quantities, (2, rows).
    """
    return next((kind for kind in KINDS if regressor.startswith(kind)), "")


def quantity_of(regressor: str) -> str:
    """Return the quantity on whose axis a curve is drawn."""
    return regressor.removeprefix(kind_of(regressor)).rpartition(OVER)[2]


def scale(what: Floats, along: Floats) -> Floats:
    """Return the course of a regressor that scales one quantity along another, (2, rows)."""
    return np.stack((along, what))


def knots_for(regressor: str, z: Floats) -> Floats:
    """Return where a curve has its values: knots of z, lags or half widths; empty: no use.

    z: the quantity alone, (rows,) or bins.
    """
    if kind_of(regressor) == PAST:
        return LAGS if np.ptp(z) > 0.0 else np.empty(0)
    if kind_of(regressor) == HYSTERESIS:
        low, high = np.quantile(z, ENDS)
        return WIDTHS * (high - low) if high > low else np.empty(0)
    if kind_of(regressor) == TURN:
        return evenly_round(KNOTS) if np.ptp(z) > 2.0 * np.pi else np.empty(0)
    return knots_between(z, FINE if kind_of(regressor) == DETAIL else KNOTS)


def columns(regressor: str, z: Floats, knots: Floats, step: float) -> Iterator[Floats]:
    """Yield the courses, (rows,) one for each knot, of which a curve is the sum.

    z: the quantity, (rows,), or what `scale` gives; step: s, of a row.
    """
    if kind_of(regressor) == PAST:
        yield from _past(z - z.mean(), knots, step)
    elif kind_of(regressor) == HYSTERESIS:
        yield from _stops(z - z.mean(), knots)
    elif kind_of(regressor) == SCALE:
        for row in np.eye(knots.size):
            yield z[1] * np.interp(z[0], knots, row)
    elif kind_of(regressor) == TURN:
        yield from _round(z, knots)
    else:
        for row in np.eye(knots.size):
            yield np.interp(z, knots, row)


def course(regressor: str, z: Floats, knots: Floats, values: Floats, step: float) -> Floats:
    """Return the curve along a course, (rows,)."""
    if kind_of(regressor) == SCALE:
        return np.asarray(z[1] * np.interp(z[0], knots, values))
    if kind_of(regressor) in ("", DETAIL):
        return np.interp(z, knots, values)
    parts = columns(regressor, z, knots, step)
    return np.asarray(sum(v * part for v, part in zip(values, parts, strict=True)))


def half_range(regressor: str, z: Floats, knots: Floats) -> Floats:
    """Return how far the courses of the knots go, (knots,), in what their values are told per."""
    if kind_of(regressor) == PAST:
        return np.full(knots.size, float(np.std(z)))
    if kind_of(regressor) == HYSTERESIS:
        return np.where(knots > 0.0, knots, float(np.std(z)))
    if kind_of(regressor) == SCALE:
        return np.full(knots.size, float(np.sqrt(np.mean(z[1] ** 2))))
    return np.ones(knots.size)


def finer(regressor: str, knots: Floats) -> Floats:
    """Return the knots with others between, as `HALVED` tells; half widths are enough."""
    for _ in range(HALVED.get(kind_of(regressor), 1)):
        knots = np.sort(np.concatenate((knots, 0.5 * (knots[1:] + knots[:-1]))))
    return knots


def evenly_round(count: int) -> Floats:
    """Return angles evenly round a turn, rad."""
    return 2.0 * np.pi * np.arange(count) / count


def step_response(knots: Floats, values: Floats, time: Floats) -> Floats:
    """What a curve of the past answers to a step of its quantity, after so many seconds."""
    return np.interp(time, knots, np.cumsum(values))


def after_a_turn(widths: Floats, values: Floats, way: Floats) -> Floats:
    """What a curve of hysteresis has changed by, so far back after a turn, slopes of z aside."""
    slid = widths > 0.0
    return np.asarray(np.minimum(way[:, None], 2.0 * widths[slid]) @ values[slid])


def knots_between(z: Floats, count: int) -> Floats:
    """Knots half at quantiles, half evenly, no two nearer than a fifth of an even step."""
    low, high = np.quantile(z, ENDS)
    if not high > low:
        return np.empty(0)
    wanted = 0.5 * np.quantile(z, np.linspace(*ENDS, count)) + 0.5 * np.linspace(low, high, count)
    return wanted[np.concatenate(([True], np.diff(wanted) > 0.2 * (high - low) / (count - 1)))]


def _round(z: Floats, knots: Floats) -> Iterator[Floats]:
    """Yield, of each knot, the orders that meet 1 there and 0 at all others, less their mean."""
    orders = np.arange(1, (knots.size - 1) // 2 + 1)
    for knot in knots:
        yield 2.0 / knots.size * np.cos(orders[:, None] * (z - knot)).sum(axis=0)


def _past(z: Floats, lags: Floats, step: float) -> Iterator[Floats]:
    """Yield z itself, then its means between each two lags; before the start it stood still."""
    yield z
    summed = np.concatenate(([0.0], np.cumsum(z) * step))
    now = step * np.arange(1, z.size + 1)

    def integral(until: Floats) -> Floats:
        inside = np.interp(until, step * np.arange(z.size + 1), summed)
        return np.asarray(inside + np.minimum(until, 0.0) * z[0])

    for near, far in pairwise(lags):
        yield (integral(now - near) - integral(now - far)) / (far - near)


def _stops(z: Floats, widths: Floats) -> Iterator[Floats]:
    """Yield what follows z within each half width, and slides beyond; 0: z itself."""
    for width in widths:
        yield _stop(z, float(width)) if width > 0.0 else z


@njit(cache=True)
def _stop(z: Floats, width: float) -> Floats:
    found = np.empty_like(z)
    now, before = 0.0, z[0]
    for i in range(z.size):
        now = min(max(now + z[i] - before, -width), width)
        before = z[i]
        found[i] = now
    return found
