"""Dates as loggers write them, in days since 1970."""

import re
from dataclasses import dataclass
from datetime import date

_EPOCH = date(1970, 1, 1).toordinal()
_ISO = re.compile(r"(\d{4})[-/.](\d{1,2})[-/.](\d{1,2})")
_EUROPEAN = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4}|\d{2})")
_STROKES = re.compile(r"(\d{1,2})[/-](\d{1,2})[/-](\d{4}|\d{2})")
_NAMED = re.compile(r"(\d{1,2})[- ]([A-Za-z]{3})[- ](\d{4})")
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_PACKED = re.compile(r"(\d{4})(\d{2})(\d{2})")
DATE_NAME = re.compile(
    r"(?:gps|utc|local|log)?[ _]*(?:date|datum|fecha|data|dato)(?:[ _]*utc)?", re.IGNORECASE
)


@dataclass(frozen=True)
class DateStyle:
    """How dates such as 03/04/2024 are written. doubtful: nothing in the file decides it."""

    day_first: bool
    doubtful: bool


def is_date(text: str) -> bool:
    """Whether a text is a date, without a time."""
    return any(style.fullmatch(text) for style in (_ISO, _EUROPEAN, _STROKES, _NAMED))


def date_style(texts: list[str]) -> DateStyle:
    """Style of the dates of a column: a number above 12 shows which one is the day."""
    pairs = [match.groups()[:2] for text in texts if (match := _STROKES.fullmatch(text))]
    if any(int(first) > 12 for first, _ in pairs):
        return DateStyle(day_first=True, doubtful=False)
    return DateStyle(day_first=False, doubtful=bool(pairs) and all(int(n) <= 12 for _, n in pairs))


def days(text: str, style: DateStyle) -> int | None:
    """Days since 1970 of a date; None where the text is none."""
    if match := _ISO.fullmatch(text) or _PACKED.fullmatch(text):
        year, month, day = map(int, match.groups())
    elif match := _EUROPEAN.fullmatch(text):
        day, month, year = map(int, match.groups())
    elif (match := _NAMED.fullmatch(text)) and match[2].casefold() in _MONTHS:
        day, year = int(match[1]), int(match[3])
        month = _MONTHS.index(match[2].casefold()) + 1
    elif match := _STROKES.fullmatch(text):
        first, second, year = map(int, match.groups())
        day, month = (first, second) if style.day_first else (second, first)
    else:
        return None
    try:
        return date(year + (2000 if year < 100 else 0), month, day).toordinal() - _EPOCH
    except ValueError:
        return None
