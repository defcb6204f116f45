"""Detect a truncated DBC file.

cantools silently omits a statement that the end of the file cuts short.
"""

import re
from collections.abc import Iterator, Mapping

_STRING = re.compile(r'"(?:[^"\\]|\\.)*"', re.DOTALL)
_MESSAGE = re.compile(r"^\s*BO_\s+\d+\s+(\w+)\s*:", re.MULTILINE)
_SIGNAL = re.compile(r"\bSG_\s+\w+(?:\s+[mM]\w*)?\s*:")
_STATEMENT = re.compile(
    r"^\s*(?:CM_|BA_\w*|VAL_|VAL_TABLE_|SIG_VALTYPE_|SG_MUL_VAL_|SIG_GROUP_|EV_|BO_TX_BU_)[ \t]+\S",
    re.MULTILINE,
)


def breaks(text: str, signals: Mapping[str, int]) -> Iterator[str]:
    """Faults of a DBC text that was not read completely. signals: number read, by message."""
    bare = _STRING.sub('""', text)
    if bare.count('"') % 2:
        yield "a text begins that does not end; the file breaks off"
    yield from _lost_signals(bare, signals)
    statements = list(_STATEMENT.finditer(bare))
    if statements and not bare[statements[-1].start() :].rstrip().endswith(";"):
        begins = " ".join(bare[statements[-1].start() :].split()[:4])
        yield f"the last statement ({begins} ...) does not end; the file breaks off"


def _lost_signals(bare: str, signals: Mapping[str, int]) -> Iterator[str]:
    heads = [*_MESSAGE.finditer(bare)]
    ends = [*(head.start() for head in heads[1:]), len(bare)]
    for head, end in zip(heads, ends, strict=False):
        listed = len(_SIGNAL.findall(bare, head.end(), end))
        read = signals.get(head.group(1), listed)
        if listed > read:
            line = bare.count("\n", 0, head.start(1)) + 1
            lost = f"only {read} of {listed} signals can be read"
            yield f"message {head.group(1)}: {lost} (line {line})"
