"""The kernel as an object file without Python: what numba compiles, as machine code for the linker.

numba's functions have a plain C interface (an array is its address and its shape); kept in the
cache folder by the fingerprint of text, compiler and processor, since compiling takes seconds.
"""

import hashlib
import platform
import tempfile
from pathlib import Path

import numba
from llvmlite import binding

from slipbench.plant import kernel
from slipbench.plant.compiled import INNER, cache_folder, inlined, load, text_of
from slipbench.plant.composition import motion_text
from slipbench.plant.fmu.entry import present, slipbench_run
from slipbench.plant.layout import EffectClass

SYMBOL = slipbench_run.__name__
SIGNATURE = "void(f8[::1],f8[:,::1],f8[::1],f8[::1],f8,i8,i8,f8[::1],i8[::1],f8[:,::1],f8[::1])"
PROCESSORS = {"x86_64": "x86-64-v2"}
"""Oldest processor on which an FMU runs, by machine; elsewhere LLVM's "generic"."""


def kernel_object(effects: tuple[EffectClass, ...]) -> bytes:
    """Return the object file with the symbol SYMBOL for these effects, this machine's format."""
    return object_of(entry_text(effects), SYMBOL)


def object_of(text: str, symbol: str) -> bytes:
    """Return the object file of a module's text, from the cache if it was compiled before.

    symbol: of its function that C calls, compiled for one signature.
    """
    made_by = f"{numba.__version__} {platform.platform()} {_processor()}"
    fingerprint = hashlib.sha256(f"{made_by}\n{symbol}\n{text}".encode()).hexdigest()[:20]
    kept = cache_folder() / f"fmu_{fingerprint}.o"
    if not kept.exists():
        _keep(kept, compiled(text, symbol))
    return kept.read_bytes()


def called_from_c(text: str, signature: str) -> str:
    """Return the text of a function that C calls. signature: as it stands in the text."""
    return f"@njit({signature}, {INNER})\n{text}\n"


def entry_text(effects: tuple[EffectClass, ...]) -> str:
    """Return the whole text that is compiled."""
    parts = [motion_text(effects), inlined(text_of(kernel.proceed)), inlined(text_of(present))]
    return "\n\n".join((*parts, called_from_c(text_of(slipbench_run), repr(SIGNATURE))))


def compiled(text: str, symbol: str) -> bytes:
    """Compile the text of a module that has the function; returns the object file."""
    (overload,) = getattr(load(text), symbol).overloads.values()
    code = overload.library.get_llvm_str().replace(overload.fndesc.llvm_func_name, symbol)
    target = binding.Target.from_triple(binding.get_process_triple())
    machine = target.create_target_machine(
        cpu=_processor(), opt=3, reloc="pic", codemodel="default"
    )
    made: bytes = machine.emit_object(binding.parse_assembly(code))
    return made


def _processor() -> str:
    return PROCESSORS.get(platform.machine(), "generic")


def _keep(path: Path, content: bytes) -> None:
    with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".tmp", delete=False) as file:
        file.write(content)
    Path(file.name).replace(path)
