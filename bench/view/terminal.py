"""The view in a terminal: phase, what is missing to arm, numbers, limits. It shows, and can do nothing."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from slipbench.protocol.extras import optional_library

if TYPE_CHECKING:
    from textual.app import App

PERIOD = 0.1  # s between two updates
BAR = 24  # characters
COLOURS = {"armed": "yellow", "exciting": "cyan", "done": "green", "tripped": "red"}
NEAR = 0.75  # share of a limit from which it is marked
NUMBERS = (
    ("rpm", "rpm", 0),
    ("gear", "gear", 0),
    ("speed", "km/h", 1),
    ("slip", "slip, %", 1),
    ("distance_left", "m left", 0),
)


def terminal_app(
    update: Callable[[], Mapping[str, Any]],
    control: Callable[[Mapping[str, Any]], object] | None = None,
) -> "App[None]":
    """Application that shows the newest state; q ends it.

    update   gives the state, as for a page
    control  of a replay: space pauses, the arrows seek; None: there is nothing to control

    Raises InputError where the extra is missing.
    """
    application: Any = optional_library("textual.app").App
    static: Any = optional_library("textual.widgets").Static

    class Watch(application):  # type: ignore[misc]  # textual is imported where it is used
        """Four blocks of text."""

        CSS = "#phase { text-style: bold; } #numbers, #limits { margin-bottom: 1; } #alarm { color: red; }"
        BINDINGS = (
            ("q", "quit", "Quit"),
            ("space", "pause", "Pause"),
            ("left", "seek(-5)", "Back 5 s"),
            ("right", "seek(5)", "On 5 s"),
        )

        def compose(self) -> Any:
            """The blocks, from top to bottom."""
            for name in ("phase", "line", "alarm", "numbers", "limits", "bench", "runs"):
                yield static("", id=name, markup=False)

        def on_mount(self) -> None:
            """Begin to update."""
            self.renew()
            self.set_interval(PERIOD, self.renew)

        def renew(self) -> None:
            """Read the state and show it."""
            state = self.state = update()
            phase = self.query_one("#phase")
            phase.styles.color = COLOURS.get(str(state.get("phase")))
            phase.update(phase_line(state))
            for name, block in blocks(state).items():
                self.query_one(f"#{name}").update(block)

        def action_pause(self) -> None:
            """Pause a replay, or go on."""
            if control is not None:
                control({"play": not self.state["playing"]})

        def action_seek(self, seconds: float) -> None:
            """Seek in a replay by some seconds."""
            if control is not None:
                control({"seek": self.state["position"] + seconds})

    made: App[None] = Watch()
    return made


def phase_line(state: Mapping[str, Any]) -> str:
    """Run and phase."""
    phase = str(state.get("phase") or "waiting").replace("_", " ").upper()
    return f"{state.get('run') or 'slipbench'}  {phase}"


def blocks(state: Mapping[str, Any]) -> dict[str, str]:
    """Text of each block below the phase."""
    shown = [f"{_number(state.get(key), digits)} {unit}" for key, unit, digits in NUMBERS]
    return {
        "line": ("not armed: " if state.get("phase") == "idle" else "")
        + str(state.get("line", "")),
        "alarm": _alarm(state),
        "numbers": "   ".join(shown),
        "limits": "\n".join(_bar(name, share) for name, share in state.get("limits", {}).items()),
        "bench": _bench(state),
        "runs": "\n".join(_run(row) for row in state.get("runs", [])),
    }


def _alarm(state: Mapping[str, Any]) -> str:
    silent = float(state.get("silent", 0.0))
    if state.get("running") and silent > 0.5:
        return f"no frame for {silent:.1f} s"
    return str(state.get("outcome", {}).get("detail", ""))


def _bar(name: str, share: float) -> str:
    filled = round(min(share, 1.0) * BAR)
    mark = "  beyond" if share >= 1.0 else "  near" if share >= NEAR else ""
    return f"{name:19} {'█' * filled}{'·' * (BAR - filled)} {share:4.0%}{mark}"


def _bench(state: Mapping[str, Any]) -> str:
    load = ", ".join(f"{bus} {share:.0%}" for bus, share in state.get("load", {}).items())
    late = state.get("lateness", {})
    faults = sum(state.get("faults", {}).values())
    return (
        f"bus load {load or '–'}; lateness up to {late.get('worst', 0.0):.3f} ms,"
        f" {late.get('late', 0)} late, {late.get('skipped', 0)} skipped; faulty frames {faults}"
    )


def _run(row: Mapping[str, str]) -> str:
    return f"{row['name']}: {row['state']}" + (f", {row['reason']}" if row["reason"] else "")


def _number(value: Any, digits: int) -> str:
    """A number of the state; a dash where it is unknown."""
    unknown = value is None or value != value
    return "–" if unknown else f"{value:.{digits}f}"
