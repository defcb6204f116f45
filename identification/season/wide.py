"""The wide table of a season, made by duckdb: a column for each fact, each tag, each parameter."""

from typing import Any

# Facts of each run or analysis, and the expression of each over the columns of the index.
FACTS = {
    "name": "CASE WHEN path = '.' THEN kind ELSE parse_filename(path) END",
    "kind": "kind",
    "session": "session",
    "date": "started",
    "recorded": "recorded",
    "vehicle": "vehicle",
    "trial": "trial",
    "actuator": "actuator",
    "excitation": "excitation",
    "amplitude": "amplitude",
    "gear": "gear",
    "engine_speed": "engine_speed",
    "duration": "duration",
    "outcome": "outcome",
    "trip": "trip",
    "verdict": "verdict",
    "reason": "reason",
    "fault": "fault",
    "path": "path",
}
TABLE = "season"
LONG_TAGS = """
    CREATE TABLE tags AS
    SELECT path, kind, tag.key AS name, tag.text AS text, tag.number AS number
    FROM (SELECT path, kind, unnest(tags) AS tag FROM entries)
"""
LONG_PARAMETERS = """
    CREATE TABLE parameters AS
    WITH found AS (SELECT path, kind, unnest(parameters) AS p FROM entries)
    SELECT path, kind, p.name AS name, p.value AS value FROM found
    UNION ALL SELECT path, kind, p.name || '_low', p.low FROM found WHERE p.low IS NOT NULL
    UNION ALL SELECT path, kind, p.name || '_high', p.high FROM found WHERE p.high IS NOT NULL
"""
KINDS = """
    SELECT name, bool_and(number IS NOT NULL), bool_or(number IS NOT NULL)
    FROM tags GROUP BY name ORDER BY name
"""


def make_wide(base: Any) -> dict[str, tuple[bool, bool]]:
    """Make the table TABLE from the table `entries` of a duckdb connection.

    Returns for each column of a tag whether it is a number in every run that has it, and whether in
    any. A tag that is called as a fact or a parameter has a column tag_NAME.
    """
    base.execute(LONG_TAGS)
    base.execute(LONG_PARAMETERS)
    taken = ", ".join(f"'{name}'" for name in FACTS)
    base.execute(
        f"UPDATE tags SET name = 'tag_' || name"
        f" WHERE name IN ({taken}) OR name IN (SELECT name FROM parameters)"
    )
    numeric = "(SELECT name FROM tags GROUP BY name HAVING bool_and(number IS NOT NULL))"
    pivots = {
        "numbers": f"SELECT path, kind, name, number AS value FROM tags WHERE name IN {numeric}",
        "texts": f"SELECT path, kind, name, text AS value FROM tags WHERE name NOT IN {numeric}",
        "estimates": "SELECT * FROM parameters",
    }
    joins = [_pivoted(base, name, long) for name, long in pivots.items()]
    facts = ", ".join(f"{made} AS {name}" for name, made in FACTS.items())
    base.execute(
        f"CREATE TABLE {TABLE} AS SELECT * FROM (SELECT {facts} FROM entries) {' '.join(joins)}"
    )
    return {name: (always, ever) for name, always, ever in base.sql(KINDS).fetchall()}


def _pivoted(base: Any, name: str, long: str) -> str:
    """Clause that joins a table with a column for each name of a long one; "" where that is empty."""
    if not base.sql(f"SELECT count(*) FROM ({long})").fetchall()[0][0]:
        return ""
    base.execute(
        f"CREATE TABLE {name} AS PIVOT ({long}) ON name USING first(value) GROUP BY path, kind"
    )
    return f"LEFT JOIN {name} USING (path, kind)"
