"""The equations of a model file, read and put in order."""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.expression import read_expression
from slipbench.identification.mismatch.systems.model_file import ModelFile


@dataclass(frozen=True)
class Equations:
    """Names in order, and the kernel's text of every equation."""

    parameters: tuple[str, ...]
    inputs: tuple[str, ...]
    states: tuple[str, ...]
    rates: tuple[str, ...]
    seams: tuple[tuple[str, str], ...]
    outputs: tuple[tuple[str, str], ...]

    @property
    def places(self) -> tuple[str, ...]:
        """Every place at which something may act, in the kernel's order."""
        return (
            *self.inputs,
            *(name for name, _ in self.seams),
            *(rate_name(state) for state in self.states),
            *(name for name, _ in self.outputs),
        )


def rate_name(state: str) -> str:
    """Return the name of the place at a state's rate."""
    return f"{state}_rate"


def equations(file: ModelFile, where: str) -> Equations:
    """Read all equations. A seam may use the seams before it. Raises InputError."""
    known = [*file.parameters, *file.inputs, *file.states]
    seams = []
    for name, seam in file.seams.items():
        read = read_expression(seam.value, known, f"{where}: seams.{name}.value")
        seams.append((name, read.text))
        known.append(name)
    rates = [
        read_expression(state.rate, known, f"{where}: states.{name}.rate").text
        for name, state in file.states.items()
    ]
    outputs = [
        (name, read_expression(output.value, known, f"{where}: outputs.{name}.value").text)
        for name, output in file.outputs.items()
    ]
    names = (tuple(part) for part in (file.parameters, file.inputs, file.states))
    parameters, inputs, states = names
    return Equations(parameters, inputs, states, tuple(rates), tuple(seams), tuple(outputs))
