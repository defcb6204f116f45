"""Every signal of a recording by name: the recorded roles, slip and slip speed."""

from slipbench.identification.signals.dataset import Dataset
from slipbench.identification.signals.motion import Motion, NoMotion
from slipbench.protocol.recording.channel import FloatArray
from slipbench.protocol.recording.roles import ROLES

COMPUTED = {"slip": "1", "slip_speed": "m/s"}


def unit_of(name: str, base: Dataset | None = None) -> str:
    """SI unit of a recorded quantity, of a role, of slip or of slip speed; "1" where none is known."""
    if name in COMPUTED:
        return COMPUTED[name]
    if base is not None and name in base.units:
        return base.units[name]
    return ROLES[name].unit if name in ROLES else "1"


def stated_unit(name: str, base: Dataset) -> str:
    """Unit that the source of a signal states; empty where it states none."""
    return base.stated.get(name, "")


def named_signal(base: Dataset, moved: Motion | NoMotion, name: str) -> FloatArray | None:
    """Signal by name in SI on the common time base, shape (n,); None where there is none."""
    if name not in COMPUTED:
        return base.get(name)
    if not isinstance(moved, Motion):
        return None
    return moved.slip.ratio if name == "slip" else moved.slip.speed


def named_signals(base: Dataset, moved: Motion | NoMotion) -> dict[str, tuple[FloatArray, str]]:
    """Every signal on the common time base: values of shape (n,) and SI unit."""
    found = {role: (value, unit_of(role, base)) for role, value in base.signals.items()}
    for name, unit in COMPUTED.items():
        value = named_signal(base, moved, name)
        if value is not None:
            found[name] = (value, unit)
    return found
