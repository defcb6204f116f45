"""The table of a season as a Parquet file, for any other tool."""

from pathlib import Path

from slipbench.identification.season.season import Season
from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library
from slipbench.protocol.new_file import new_file


def write_season(season: Season, path: Path, where: str | None = None) -> int:
    """Write all columns of the rows for which `where` holds into a new file; returns their number.

    Raises InputError for another suffix than .parquet, a file that exists, or a wrong filter.
    """
    if path.suffix != ".parquet":
        raise InputError(
            "only Parquet is written", where=str(path), expected="a name that ends with .parquet"
        )
    rows = season.arrow(where)
    with new_file(path) as draft:
        optional_library("pyarrow.parquet").write_table(rows, draft)
    return int(rows.num_rows)
