"""The equations of a model file, parsed and in the order of evaluation."""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.expression import Delay, Expression, read_expression
from slipbench.identification.mismatch.systems.model_file import ModelFile
from slipbench.identification.mismatch.systems.stops import Stop, read_stops


@dataclass(frozen=True)
class Equations:
    """Names in kernel order, and the kernel text of every equation.

    delays: each place whose equation has delayed quantities, with these. stops: of states.
    """

    parameters: tuple[str, ...]
    inputs: tuple[str, ...]
    states: tuple[str, ...]
    rates: tuple[str, ...]
    seams: tuple[tuple[str, str], ...]
    outputs: tuple[tuple[str, str], ...]
    delays: tuple[tuple[str, tuple[Delay, ...]], ...] = ()
    stops: tuple[Stop, ...] = ()

    @property
    def places(self) -> tuple[str, ...]:
        """Names of all injection points, in kernel order."""
        return (
            *self.inputs,
            *(name for name, _ in self.seams),
            *(rate_name(state) for state in self.states),
            *(name for name, _ in self.outputs),
        )


def rate_name(state: str) -> str:
    """Return the name of the injection point at a state's rate."""
    return f"{state}_rate"


def equations(file: ModelFile, where: str) -> Equations:
    """Parse all equations. A seam may use the seams before it. Raises InputError."""
    known = [*file.inputs, *file.states]

    def read(text: str, key: str) -> Expression:
        return read_expression(text, known, f"{where}: {key}", (*file.parameters,))

    seams = {}
    for name, seam in file.seams.items():
        seams[name] = read(seam.value, f"seams.{name}.value")
        known.append(name)
    rates = {n: read(s.rate, f"states.{n}.rate") for n, s in file.states.items()}
    outputs = {n: read(o.value, f"outputs.{n}.value") for n, o in file.outputs.items()}
    in_order = [*seams.items(), *((rate_name(n), r) for n, r in rates.items()), *outputs.items()]
    return Equations(
        (*file.parameters,),
        (*file.inputs,),
        (*file.states,),
        tuple(r.text for r in rates.values()),
        tuple((n, s.text) for n, s in seams.items()),
        tuple((n, o.text) for n, o in outputs.items()),
        tuple((place, e.delays) for place, e in in_order if e.delays),
        read_stops(file, where),
    )
