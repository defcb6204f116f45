"""Real-time ECU and traction-control bench over CAN: excite, record, identify, explain.

The names in `__all__` are the public interface; docs/api.md shows each. A name is imported when it
is first used: `import slipbench` alone loads no other module.
"""

from importlib import import_module

TYPE_CHECKING = False  # as typing's; to import that takes a while in which Ctrl-C is a traceback
if TYPE_CHECKING:
    from slipbench.api import (
        Trial,
        design,
        explain,
        export,
        fit_models,
        identify,
        import_log,
        load_controller,
        load_database,
        load_vehicle,
        read,
        recording_of,
        replay,
    )
    from slipbench.controllers.slip_controller import SlipController
    from slipbench.identification.mismatch.callables.parameter import Parameter
    from slipbench.plant.vehicle_file import Vehicle
    from slipbench.protocol.codec.codec import Codec
    from slipbench.protocol.errors import InputError
    from slipbench.protocol.logs.decoded_log import decode
    from slipbench.protocol.recording.recording import Recording

    __version__: str

__all__ = [
    "Codec",
    "InputError",
    "Parameter",
    "Recording",
    "SlipController",
    "Trial",
    "Vehicle",
    "decode",
    "design",
    "explain",
    "export",
    "fit_models",
    "identify",
    "import_log",
    "load_controller",
    "load_database",
    "load_vehicle",
    "read",
    "recording_of",
    "replay",
]

_ELSEWHERE = {
    "Codec": "protocol.codec.codec",
    "InputError": "protocol.errors",
    "Parameter": "identification.mismatch.callables.parameter",
    "Recording": "protocol.recording.recording",
    "SlipController": "controllers.slip_controller",
    "Vehicle": "plant.vehicle_file",
    "decode": "protocol.logs.decoded_log",
}


def __getattr__(name: str) -> object:
    if name == "__version__":
        return _version()
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"slipbench.{_ELSEWHERE.get(name, 'api')}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, "__version__"})


def _version() -> str:
    """Version of the installed package; "unknown" where the sources are used without installing."""
    from importlib import metadata

    try:
        return metadata.version("slipbench")
    except metadata.PackageNotFoundError:
        return "unknown"
