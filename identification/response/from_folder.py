"""A run folder that a user named: read, identified, or refused in words."""

from pathlib import Path

from slipbench.identification.response.identify import Identification, identify
from slipbench.identification.response.selection import Selection
from slipbench.identification.signals.trial_window import NoExcitation
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.run_folder import read


def identified_folder(run: Path) -> Identification:
    """Read and identify. Raises InputError where there is nothing, or it is damaged."""
    return identified(read(run))


def identified(recording: Recording, selection: Selection | None = None) -> Identification:
    """Identify, or say why nothing can be identified. Raises InputError."""
    if not any(channel.time.size for channel in recording.channels.values()):
        raise InputError(
            "the recording holds no samples of any role",
            where=str(recording.folder),
            expected=f"samples of {', '.join(sorted(recording.roles.roles)) or 'some role'}",
            found=f"{recording.frame_count} frames, none of which a role comes from",
            remedy="check that the role map and the database belong to this vehicle",
        )
    found = identify(recording, selection)
    if isinstance(found.window, NoExcitation) and found.window.tripped:
        raise InputError(
            "the trial tripped before it excited anything",
            where=str(recording.folder),
            expected="a phase EXCITING in trial_phase",
            found=found.window.reason,
            remedy="fix the cause of the trip and repeat the trial",
        )
    return found
