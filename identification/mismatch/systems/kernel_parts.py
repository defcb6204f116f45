"""Text of functions that a compiled kernel calls: delays of what jumps between rows, broken lines."""

WITHIN, FIRST, ROW, STEP, END = range(5)
"""When the rates are evaluated: within a step, at the beginning of all, of a row, of a later step
of the same row, and at a row's end."""

# A quantity is the sum of its jumps between rows, which are level over a step, and of a rest that
# follows lines in a step. Of the delayed jumps the mean over the step acts: at the stages of a step
# alone, a jump within the step would not move with the delay.
# ring: jumps so far, and the rest at a step's beginning. memory: the whole at the last row's end.
KEEP = f"""def keep(ring, memory, count, when, value):
    here, before = count & (ring.shape[1] - 1), (count - 1) & (ring.shape[1] - 1)
    if when == {FIRST}:
        ring[0, :], ring[1, :] = 0.0, value
    elif when == {END}:
        memory[0] = value
    elif when != {WITHIN}:
        ring[0, here] = ring[0, before] + (value - memory[0] if when == {ROW} else 0.0)
        ring[1, here] = value - ring[0, here]
"""
PAST = """def past(ring, count, fraction, value, delay_steps):
    mask = ring.shape[1] - 1
    whole = int(delay_steps)
    share = delay_steps - whole
    new, old = ring[0, (count - whole) & mask], ring[0, (count - whole - 1) & mask]
    jumps = new + share * (old - new)
    place = fraction - delay_steps
    if place >= 0.0:
        begun, now = ring[1, count & mask], value - ring[0, count & mask]
        return jumps + (begun + (now - begun) * place / fraction if fraction > 0.0 else now)
    whole = int(-place)
    share = -place - whole
    new, old = ring[1, (count - whole) & mask], ring[1, (count - whole - 1) & mask]
    return jumps + new + share * (old - new)
"""

# A broken line, level beyond its knots. table: knots, values; the last may be repeated.
LINE = """def line(table, z):
    last = table.shape[1] - 1
    if z <= table[0, 0]:
        return table[1, 0]
    for k in range(1, last + 1):
        if z < table[0, k]:
            share = (z - table[0, k - 1]) / (table[0, k] - table[0, k - 1])
            return table[1, k - 1] + share * (table[1, k] - table[1, k - 1])
    return table[1, last]
"""
