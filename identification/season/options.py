"""Which options of `slipbench runs` go together: one that would have no effect is an error."""

from collections.abc import Mapping

from slipbench.protocol.errors import InputError

WITHOUT_FILTER = ("--tag", "--compare")  # they name their runs


def check_options(
    actions: Mapping[str, object], of_trend: Mapping[str, object], where: str | None
) -> None:
    """Check the options that were given. Raises InputError where one of them would be ignored.

    actions: options of which one may be given; of_trend: those that only --trend uses
    """
    given = [name for name, value in actions.items() if value]
    if len(given) > 1:
        raise InputError(
            "these options do not go together",
            found=" and ".join(given),
            remedy="give one command for each",
        )
    unused = [name for name, value in of_trend.items() if value is not None]
    if unused and "--trend" not in given:
        raise InputError(f"{unused[0]} needs --trend PARAMETER", remedy="name the parameter")
    if where is not None and given and given[0] in WITHOUT_FILTER:
        raise InputError(
            f"--where has no effect on {given[0]}, which names its runs", remedy="leave it out"
        )
