"""The sub-command of this package: `slipbench runs`."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:  # duckdb and pyarrow are of an extra; --help does not need them
    from slipbench.identification.season.season import Season

EXAMPLE = "Example: slipbench runs 2026 --where \"tyre = 'new' and mileage > 300\""
STYLES = {"good": "green", "not usable": "red", "repeat": "red", "incomplete": "red"}
FIRST_LEFT_OUT = ("excitation", "amplitude", "kind", "actuator")
WIDE = Console(width=10_000)  # characters; for measures only


def register(app: typer.Typer) -> None:
    """Add `runs` to the one command."""
    app.command("runs", epilog=EXAMPLE)(runs_command)


def runs_command(
    folder: Annotated[
        Path,
        typer.Argument(metavar="FOLDER", help="Folder with runs, sessions and analyses in it."),
    ],
    tags: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="KEY=VALUE", help="With --tag: tyre=new mileage=812; KEY= removes a tag."
        ),
    ] = None,
    where: Annotated[
        str | None,
        typer.Option(
            metavar="SQL",
            help="Only runs for which this holds: \"tyre = 'new' and mileage > 300\".",
        ),
    ] = None,
    columns: Annotated[
        str | None,
        typer.Option(
            metavar="SQL", help='Columns to show: "name, mileage, dead_time". `all` names them.'
        ),
    ] = None,
    compare: Annotated[
        tuple[str, str] | None,
        typer.Option(
            metavar="RUN RUN", help="Two runs side by side: tags, and parameters against intervals."
        ),
    ] = None,
    trend: Annotated[
        str | None,
        typer.Option(
            metavar="PARAMETER",
            help="Trend of a parameter with its interval, and sudden changes (5 % false alarms).",
        ),
    ] = None,
    over: Annotated[
        str | None,
        typer.Option(
            help="Abscissa of the trend: date (runs of a day are pooled), time, or a tag: mileage."
            "  [default: date]"
        ),
    ] = None,
    figure: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Figure of the trend, a new file: .png, .svg or .pdf."),
    ] = None,
    tag: Annotated[
        str | None,
        typer.Option(
            metavar="RUN", help="Tag this run, or all runs of this session, with KEY=VALUE."
        ),
    ] = None,
    export: Annotated[
        Path | None,
        typer.Option(metavar="FILE.parquet", help="Write all columns of these runs to a new file."),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(help="Address of a dask cluster with access to the same folder: reads there."),
    ] = None,
) -> None:
    """List the runs, sessions and analyses below a folder, newest first.

    Each run has its verdict, the parameters of `identify` with 95 % intervals, and its tags: the table
    [tags] of run.toml, which a session plan or --tag fills. An `explain` has the size of each effect. A
    damaged run is listed with its fault. The index in FOLDER/.slipbench-index is read again only where
    a run was changed.

    Exit status: 0 done, 2 invalid input (see message).
    """
    from slipbench.identification.season.options import check_options

    check_options(
        {
            "--tag": tag or tags,
            "--compare": compare,
            "--trend": trend,
            "--export": export,
            "--columns": columns,
        },
        {"--over": over, "--figure": figure},
        where,
    )
    if tag is not None or tags:
        from slipbench.identification.season.tagging import tag_runs

        typer.echo("\n".join(tag_runs(folder, tag, tags or [])))
        return
    season = _season(folder, scheduler)
    if columns == "all":
        typer.echo("\n".join(season.columns))
        return
    if export is not None:
        from slipbench.identification.season.export import write_season

        typer.echo(f"{write_season(season, export, where)} rows: {export}")
        return
    if compare is not None:
        from slipbench.identification.season.side_by_side import pair, table

        _print_whole(*table(season, *pair(season, compare)))
        return
    if trend is not None:
        typer.echo("\n".join(_trend(season, trend, over or "date", where, figure)))
        return
    _list(season, columns, where)


def _trend(
    season: "Season", parameter: str, over: str, where: str | None, figure: Path | None
) -> list[str]:
    """Lines on the trend of a parameter; draws it where a figure is asked for."""
    from slipbench.identification.season.points import points
    from slipbench.identification.season.trend import trend
    from slipbench.identification.season.trend_words import lines

    found = trend(points(season, parameter, over, where))
    if figure is None:
        return lines(found)
    from slipbench.identification.season.trend_figure import write_figure

    write_figure(found, figure)
    return [*lines(found), f"figure: {figure}"]


def _season(folder: Path, scheduler: str | None) -> "Season":
    from slipbench.identification.season.index import refreshed
    from slipbench.identification.season.season import Season

    console = Console(stderr=True)
    with console.status("reading runs"):
        return Season(refreshed(folder, scheduler, lambda text: typer.echo(text, err=True)))


def _list(season: "Season", columns: str | None, where: str | None) -> None:
    """Print the table of runs, then what is at fault."""
    from slipbench.identification.season.listing import faults, listing, selected

    rows = season.rows(where)
    if not rows:
        typer.echo(
            "no run fits the filter" if season.entries else "there is no run below this folder"
        )
        return
    _print(*(selected(season, columns, where) if columns else listing(season, where)))
    for line in faults(season, rows):
        typer.echo(f"fault: {line}")


def _print(headings: list[str], cells: list[list[str]]) -> None:
    """Print a table; to a terminal only the columns that fit, the others by name."""
    console, kept = Console(highlight=False), list(range(len(headings)))
    while console.is_terminal and len(kept) > 1:
        if WIDE.measure(_table_of(headings, cells, kept)).maximum <= console.width:
            break
        early = [i for i in kept if headings[i] in FIRST_LEFT_OUT]
        kept.remove(early[0] if early else kept[-1])
    _print_whole([headings[i] for i in kept], [[row[i] for i in kept] for row in cells])
    left_out = [one for i, one in enumerate(headings) if i not in kept]
    if left_out:
        console.print(f"no room for: {', '.join(left_out)} (--columns selects)", style="dim")


def _print_whole(headings: list[str], cells: list[list[str]]) -> None:
    """Print a table as wide as it is."""
    table = _table_of(headings, cells, range(len(headings)))
    Console(highlight=False, width=max(WIDE.measure(table).maximum, 1)).print(table)


def _table_of(headings: list[str], cells: list[list[str]], kept: Sequence[int]) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for i in kept:
        table.add_column(headings[i], no_wrap=True)
    for row in cells:
        table.add_row(*(Text(row[i], style=STYLES.get(row[i], "")) for i in kept))
    return table
