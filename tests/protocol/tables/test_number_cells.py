"""Laws: a number is the same with either decimal mark, with groups or without; nothing else is a number."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from slipbench.protocol.recording.role_map import TableRules
from slipbench.protocol.tables import read_table, samples
from slipbench.protocol.tables.csv_layout import unique_names
from slipbench.protocol.tables.number_cells import decimal_of, number, numbers

ANY = TableRules()
GROUPS = {"none": "", "blank": " ", "no-break": "\u00a0", "apostrophe": "'", "other mark": None}
MISSING = ["---", "----", "   ", "?", "*****", "#DIV/0!", "#WERT!", "1.#QNAN", "-nan", "nan(ind)"]
hundredths = st.integers(-(10**9), 10**9)


def written(value, decimal, groups):
    """Hundredths as a spreadsheet writes them: 1.234.567,89"""
    divider = {".": ",", ",": "."}[decimal] if groups is None else groups
    whole = f"{abs(value) // 100:,}".replace(",", divider)
    return f"{'-' if value < 0 else ''}{whole}{decimal}{abs(value) % 100:02d}"


@given(
    st.lists(st.one_of(hundredths, st.sampled_from(MISSING)), min_size=1, max_size=20),
    st.sampled_from(",."),
    st.sampled_from(sorted(GROUPS)),
)
def test_a_column_is_the_same_in_every_style(values, decimal, groups):
    cells = [v if isinstance(v, str) else written(v, decimal, GROUPS[groups]) for v in values]
    found = numbers(cells, decimal)
    expected = [np.nan if isinstance(v, str) else v / 100 for v in values]
    assert np.array_equal(found, expected, equal_nan=True)
    if any(isinstance(value, int) for value in values):
        assert decimal_of([cells]) == (decimal, False)


@given(st.integers(1, 999), st.integers(0, 999), st.sampled_from(",."))
def test_what_may_be_a_group_or_a_fraction_is_not_guessed(thousands, rest, decimal):
    """1.234 in a table with decimal commas is 1234 or 1.234, unless its column has 1.234,5 too."""
    other = {".": ",", ",": "."}[decimal]
    cell = f"{thousands}{other}{rest:03d}"
    assert numbers([cell], decimal) == 0
    assert numbers([f"1{other}000{decimal}5", cell], decimal).tolist() == [
        1000.5,
        1000 * thousands + rest,
    ]


@given(
    st.sampled_from(["12..5", "1,2,3", "0x1F", "1_000", "5 V", "12:30", "1e", "+", "drei", "1 2"])
)
def test_text_is_no_number(cell):
    for decimal in ",.":
        assert not isinstance(number(cell, decimal), float) or np.isnan(number(cell, decimal))
    assert number("5 V", ".") is None


@given(st.integers(150, 400), st.integers(0, 120), st.sampled_from(["; ,", ", ,q", "; .", ", ."]))
@example(200, 0, "; ,")  # in line 201, behind the lines from which the layout is known
@settings(max_examples=30, deadline=None)
def test_the_first_decimals_may_stand_anywhere(tmp_path_factory, count, at, style):
    """Whole numbers in the first hundreds of lines decide nothing."""
    delimiter, decimal, quote = style[0], style[2], '"' * style.count("q")
    values = [0.0] * count
    values[-1 - at] = 0.5
    rows = [
        delimiter.join([str(n), f"{quote}{value:g}{quote}".replace(".", decimal)])
        for n, value in enumerate(values)
    ]
    path = tmp_path_factory.mktemp("late") / "x.csv"
    path.write_text("\n".join([f"Time [ms]{delimiter}p [bar]", *rows]) + "\n")
    assert samples(read_table(path), "p", "", ANY).value.tolist() == values


@pytest.mark.parametrize("cell", MISSING)
def test_cells_without_a_number_are_counted(tmp_path, cell):
    path = tmp_path / "x.csv"
    path.write_text(f"Time [s],a\n0,1\n1,{cell}\n2,3\n")
    table = read_table(path)
    assert samples(table, "a", "", ANY).time.tolist() == [0, 2]
    said = bool(cell.strip()) and "nan" not in cell  # NaN says itself that it is no number
    assert (f"count as empty: 1, the first {cell!r}" in str(table.warnings)) == said


@given(st.lists(st.sampled_from(["a", "a #2", "a #3", "", "b"]), max_size=12))
def test_names_of_columns_become_unique(names):
    unique = unique_names(names)
    assert len(set(unique)) == len(names)
    assert all(one.startswith(name) for one, name in zip(unique, names, strict=True))
    assert all(name in unique for name in names)
