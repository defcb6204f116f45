"""Effects with a memory, each as a textbook writes it: one short Euler step at a time.

No code is shared with the pages of the library. A law takes the quantity, the speed or other
second quantity, and the time step; it returns the acting value.
"""

import math
from collections import deque
from collections.abc import Callable

Law = Callable[[float, float, float], float]


def slewed(limit: float) -> Law:
    """A quantity that follows with at most this rate, per second."""
    out = None

    def law(value: float, other: float, h: float) -> float:
        nonlocal out
        out = value if out is None else out + min(max(value - out, -limit * h), limit * h)
        return out

    return law


def braked(deceleration: float) -> Law:
    """y' = sign(e) sqrt(2 A |e|), e = f - y."""
    out = None

    def law(value: float, other: float, h: float) -> float:
        nonlocal out
        out = value if out is None else out
        remaining = value - out
        move = h * math.sqrt(2.0 * deceleration * abs(remaining))
        out += math.copysign(min(move, abs(remaining)), remaining)
        return out

    return law


def plays(*widths: float) -> Law:
    """Mean of several plays."""
    at: list[float] = []

    def law(value: float, other: float, h: float) -> float:
        kept = at or [value] * len(widths)
        at[:] = [min(max(k, value - w), value + w) for k, w in zip(kept, widths, strict=True)]
        return sum(at) / len(at)

    return law


def yields(share: float, level: float) -> Law:
    """Bouc-Wen with n = 1, in short steps of the quantity."""
    before, z = None, 0.0

    def law(value: float, other: float, h: float) -> float:
        nonlocal before, z
        change = 0.0 if before is None else value - before
        before = value
        parts = max(1, math.ceil(abs(change) / (0.01 * level)))
        for _ in range(parts):
            d = change / parts
            z += d * (1.0 - abs(z) / level) if z * d > 0.0 else d
        return value + share * (z - value)

    return law


def dahl(force: float, distance: float) -> Law:
    """z' = v (1 - z sign v / s)."""
    z = 0.0

    def law(value: float, other: float, h: float) -> float:
        nonlocal z
        z += h * other * (1.0 - z * math.copysign(1.0, other) / distance)
        return value - force * z / distance

    return law


def late(delay: float) -> Law:
    """A delayed value."""
    line: deque[float] = deque()

    def law(value: float, other: float, h: float) -> float:
        if not line:
            line.extend([value] * round(delay / h))
        line.append(value)
        return line.popleft()

    return law


def averaged(window: float) -> Law:
    """The mean of the last values."""
    line: deque[float] = deque()

    def law(value: float, other: float, h: float) -> float:
        if not line:
            line.extend([value] * round(window / h))
        line.append(value)
        line.popleft()
        return sum(line) / len(line)

    return law


def trailing(time_constant: float) -> Law:
    """A first-order lag."""
    out = None

    def law(value: float, other: float, h: float) -> float:
        nonlocal out
        out = value if out is None else out + h / time_constant * (value - out)
        return out

    return law


def swinging(frequency: float, damping: float) -> Law:
    """A second-order lag."""
    x, v = None, 0.0

    def law(value: float, other: float, h: float) -> float:
        nonlocal x, v
        x = value if x is None else x
        v += h * frequency * (frequency * (value - x) - 2.0 * damping * v)
        x += h * v
        return x

    return law


def beside(share: float, frequency: float, damping: float, gap: float = 0.0) -> Law:
    """Part of the inertia on a spring behind a gap."""
    d, v = 0.0, 0.0

    def law(value: float, other: float, h: float) -> float:
        nonlocal d, v
        wound = math.copysign(max(abs(d) - gap, 0.0), d)
        pull = frequency**2 * wound + (2.0 * damping * frequency * v if wound else 0.0)
        driven = (value + share * pull) / (1.0 - share)
        v -= h * (pull + driven)
        d += h * v
        return driven

    return law


def tired(loss: float, time_constant: float, power: int) -> Law:
    """A gain that falls with past work."""
    state = 0.0

    def law(value: float, other: float, h: float) -> float:
        nonlocal state
        gain = 1.0 - loss * state
        state += h / time_constant * (abs(value) ** power - state)
        return gain * value

    return law
