"""Lines of a text file in the encodings that loggers and spreadsheets write."""

import codecs
from dataclasses import dataclass

_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig", "UTF-8"),
    (codecs.BOM_UTF16_LE, "utf-16", "UTF-16"),
    (codecs.BOM_UTF16_BE, "utf-16", "UTF-16"),
)
_LOOKED_AT = 2000  # bytes
_ZEROS = 0.3  # share of zero bytes at even or odd positions from which a text is UTF-16


@dataclass(frozen=True)
class Text:
    """Lines of a file, its encoding, and the number of characters that could not be decoded."""

    lines: list[str]
    encoding: str
    undecoded: int = 0


def decode_text(content: bytes) -> Text:
    """Text of a file: UTF-8, UTF-16 with or without its mark, else Windows-1252 (Latin-1)."""
    codec, name = _codec(content)
    if codec:
        return _lenient(content, codec, name)
    try:
        return Text(content.decode("utf-8").splitlines(), "UTF-8")
    except UnicodeDecodeError as cause:
        if cause.reason == "unexpected end of data" and cause.end == len(content):
            return _lenient(content, "utf-8", "UTF-8")  # broken off within a character
        return _lenient(content, "cp1252", "Windows-1252")


def _lenient(content: bytes, codec: str, name: str) -> Text:
    text = content.decode(codec, errors="replace")
    return Text(text.splitlines(), name, text.count("�"))


def _codec(content: bytes) -> tuple[str, str]:
    for mark, codec, name in _MARKS:
        if content.startswith(mark):
            return codec, name
    head = content[:_LOOKED_AT]
    for codec, zeros in (("utf-16-le", head[1::2]), ("utf-16-be", head[::2])):
        if len(head) > 3 and zeros.count(0) > _ZEROS * len(zeros):
            return codec, "UTF-16 without a mark"
    return "", ""
