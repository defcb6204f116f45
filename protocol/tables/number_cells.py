"""Numbers in cells of text, as loggers and spreadsheets write them.

The decimal mark is a point or a comma, and one for a whole table. Groups of three digits may be divided
by a blank or an apostrophe, or by the other mark where a cell has both: 1.234,5. A cell without a letter
or a digit (---), or with a number sign (#DIV/0!, 1.#QNAN), holds no value.
"""

import re
from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

EMPTY = frozenset(
    ("", "-", "--", "nan", "NaN", "NAN", "null", "NULL", "None", "N/A", "n/a", "#N/A", "NA")
)
OTHER_MARK = {".": ",", ",": "."}
_EMPTY_WORDS = frozenset(word.casefold() for word in EMPTY)
_NAN = re.compile(r"[+-]?s?nan(?:\(\w*\))?")
_ANY_CHARACTER = re.compile(r"[^\W_]")
_BARE = re.compile(r"[+-]?(?:(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|inf(?:inity)?)", re.IGNORECASE)
_GROUPS = re.compile(r"(?<=\d)[ \u00a0\u202f'\u2019](?=\d{3}(?!\d))")

_DECIMAL = {mark: re.compile(rf"[+-]?\d*[{mark}]\d+(?:[eE][+-]?\d+)?") for mark in ".,"}
# "1,234" may be one thousand or one; "1,234,567" and "1,234.5" have groups, "1,5" has none.
_MAY_BE_GROUPS = {mark: re.compile(rf"[+-]?[1-9]\d{{0,2}}[{mark}]\d{{3}}") for mark in ".,"}
_HAS_GROUPS = {
    mark: re.compile(
        rf"[+-]?\d{{1,3}}(?:[{mark}]\d{{3}})+(?:[{OTHER_MARK[mark]}]\d+|[{mark}]\d{{3}})"
    )
    for mark in ".,"
}


def decimal_of(rows: Iterable[Sequence[str]]) -> tuple[str, bool]:
    """Decimal mark of rows of cells, and whether its commas may as well divide thousands.

    Cells that can have one mark only decide. Where none is such a cell, as in "1,234", a comma is the
    decimal mark, and doubtful.
    """
    cells = [_GROUPS.sub("", cell) for row in rows for cell in row]
    commas, points = (sum(_must_be(mark, cell) for cell in cells) for mark in ",.")
    if commas or points:
        return ("," if commas >= points else "."), False
    doubtful = any(map(_MAY_BE_GROUPS[","].fullmatch, cells))
    return ("," if doubtful else "."), doubtful


def _must_be(mark: str, cell: str) -> bool:
    """Whether a cell is a number with this decimal mark, and none with the other one."""
    if _HAS_GROUPS[OTHER_MARK[mark]].fullmatch(cell):
        return True
    return bool(_DECIMAL[mark].fullmatch(cell)) and not _MAY_BE_GROUPS[mark].fullmatch(cell)


def is_missing(cell: str) -> bool:
    """Whether a cell states that there is no value."""
    text = cell.strip().casefold()
    no_number = "#" in text or bool(_NAN.fullmatch(text)) or text in _EMPTY_WORDS
    return no_number or not _ANY_CHARACTER.search(text)


def number(cell: str, decimal: str, *, grouped: bool = False) -> float | None:
    """Number of a cell, NaN where it states that there is none; None where it holds text.

    grouped: whether the mark that is not the decimal one divides groups of three digits.
    """
    if is_missing(cell):
        return np.nan
    text = _GROUPS.sub("", cell.strip())
    other = OTHER_MARK[decimal]
    if grouped:
        text = re.sub(rf"(?<=\d)[{other}](?=\d{{3}}(?!\d))", "", text)
    if other in text:
        return None
    plain = text.replace(decimal, ".")
    return float(plain) if _BARE.fullmatch(plain) else None


def numbers(texts: Sequence[str | None], decimal: str) -> npt.NDArray[np.float64] | int:
    """Numbers of the cells of one column, (n,), NaN for none; the first row that holds text, if any."""
    cells = dict.fromkeys(text for text in texts if text is not None)
    grouped = any(_HAS_GROUPS[OTHER_MARK[decimal]].fullmatch(cell.strip()) for cell in cells)
    known: dict[str | None, float | None] = {
        cell: number(cell, decimal, grouped=grouped) for cell in cells
    }
    known[None] = np.nan
    odd = next((row for row, text in enumerate(texts) if known[text] is None), None)
    return np.array([known[text] for text in texts], np.float64) if odd is None else odd


def number_expected(decimal: str) -> str:
    """Expected content of a cell, for an error message."""
    return f"a number{' with a decimal comma' if decimal == ',' else ''}, or an empty cell"
