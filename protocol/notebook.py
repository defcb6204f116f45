"""HTML for notebooks: a heading, a sentence and tables, with every text escaped.

`_repr_html_` of a result calls `card`; Jupyter shows what it returns.
"""

from collections.abc import Iterable, Sequence
from html import escape


def card(title: str, lines: Sequence[str] = (), *tables: str) -> str:
    """HTML of a result: a title, paragraphs and tables that `table` made."""
    paragraphs = "".join(f"<p>{escape(line)}</p>" for line in lines)
    return f"<div><p><b>{escape(title)}</b></p>{paragraphs}{''.join(tables)}</div>"


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """HTML of a table; empty text where it has no rows. Numbers are shown with four digits."""
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)
    if not body:
        return ""
    head = "".join(f"<th>{escape(name)}</th>" for name in header)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _cell(value: object) -> str:
    text = f"{value:.4g}" if isinstance(value, float) else str(value)
    return f"<td>{escape(text)}</td>"
