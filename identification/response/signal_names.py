"""Names of the signals that a user may select, and messages about a name that is not among them."""

import difflib
from collections.abc import Mapping
from dataclasses import dataclass

from slipbench.identification.signals.dataset import Dataset
from slipbench.identification.signals.motion import Motion, NoMotion
from slipbench.identification.signals.named import named_signals, stated_unit
from slipbench.protocol.errors import InputError

NEAR = 0.6  # similarity from which a name is proposed


@dataclass(frozen=True)
class Names:
    """Signals of a recording. absent: name -> why it cannot be used."""

    base: Dataset
    moved: Motion | NoMotion
    absent: Mapping[str, str]

    def meant(self, name: str) -> str:
        """Return the name of the one signal that differs in case, spaces and underscores only, if any."""
        known = named_signals(self.base, self.moved)
        same = [one for one in known if _plain(one) == _plain(name)]
        return same[0] if name not in known and len(same) == 1 else name

    def unknown(self, name: str, option: str, where: str) -> InputError:
        """Return the error for a name without a signal: why it has none, or the nearest name."""
        if name in self.absent:
            return InputError(
                f"the signal {name} cannot be used",
                where=where,
                found=self.absent[name],
                remedy=f"correct the recording, or give another {option}",
            )
        why = near = ""
        if name == "slip" and isinstance(self.moved, NoMotion):
            why = f": {self.moved.reason}"
        else:
            near = self._nearest(name)
        hint = f"; did you mean {near!r}?" if near else ""
        return InputError(
            f"there is no signal {name}{why}{hint}; {self._listed()}",
            where=where,
            remedy=f"give {option} one of these names",
        )

    def not_given(self, option: str, why: str, where: str) -> InputError:
        """Return the error for an option that has no default in this recording."""
        what = f"{option} must be given: {why}; {self._listed()}"
        return InputError(what, where=where, remedy=f"give {option}")

    def _listed(self) -> str:
        """Return the signals with their units: too long a list for any part but the first of a message."""
        signals = sorted(named_signals(self.base, self.moved).items())
        known = [f"{name} [{stated_unit(name, self.base) or si}]" for name, (_, si) in signals]
        return f"the signals are {', '.join(known) or 'none'}"

    def _nearest(self, name: str) -> str:
        """Return the nearest name, upper or lower case; empty where none is near."""
        known = {
            one.casefold(): one for one in (*named_signals(self.base, self.moved), *self.absent)
        }
        near = difflib.get_close_matches(name.casefold(), known, n=1, cutoff=NEAR)
        return known[near[0]] if near else ""


def _plain(name: str) -> str:
    return " ".join(name.casefold().replace("_", " ").split())
