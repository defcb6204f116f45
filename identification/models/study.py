"""All models and harmonics that one recording supports, and why not where it does not.

study = study_of(identify(read(folder)))
study.models[0].fit.model, study.harmonics, study.left_out
"""

from dataclasses import dataclass

from slipbench.identification.models.recommended import Recommended, recommended
from slipbench.identification.models.validation import NoValidation, Validation, validated
from slipbench.identification.response.describing_function import DescribingFunction, NoHarmonics
from slipbench.identification.response.harmonics import harmonics
from slipbench.identification.response.identify import Identification
from slipbench.identification.response.independent_lines import NoRational
from slipbench.identification.response.left_out import LeftOut
from slipbench.identification.response.swept_recording import swept_run_of
from slipbench.identification.signals.swept_phase import NoSweep
from slipbench.protocol.notebook import card, table


@dataclass(frozen=True)
class Study:
    """models: one for each response to slip that carries one; harmonics: of the slip, in a sweep.

    validations: of the models, on held-out data of the same recording; left_out: what the responses do not carry, beside what the recording does not.
    """

    models: tuple[Recommended, ...]
    harmonics: DescribingFunction | None
    left_out: tuple[LeftOut, ...]
    validations: tuple[Validation, ...] = ()

    def _repr_html_(self) -> str:
        models = [one.fit.model for one in self.models]
        rows = [
            (m.input, m.output, m.zeros.size, m.poles.size, f"{1e3 * m.delay:.4g} ms")
            for m in models
        ]
        head = ("input", "output", "zeros", "poles", "dead time")
        missing = [(one.analysis, one.reason) for one in self.left_out]
        return card("Models", [], table(head, rows), table(("not estimated", "reason"), missing))


def study_of(found: Identification) -> Study:
    """Model every response to slip, or to the selected output, and validate the models; find the harmonics where a sweep excited."""
    output = found.main.output if found.main else "slip"
    models_or_reasons = [(one, recommended(one)) for one in found.responses if one.output == output]
    models = tuple(model for _, model in models_or_reasons if isinstance(model, Recommended))
    omitted = [
        LeftOut(f"model from {response.input} to {response.output}", why.reason)
        for response, why in models_or_reasons
        if isinstance(why, NoRational)
    ]
    checked = [validated(found, one) for one in models]
    validations = tuple(one for one in checked if isinstance(one, Validation))
    omitted += [
        LeftOut(f"validation of the model from {one.input} to {one.output}", one.reason)
        for one in checked
        if isinstance(one, NoValidation)
    ]
    if output != "slip" or found.main is None:
        return Study(models, None, tuple(omitted), validations)
    distorted = _harmonics(found)
    if isinstance(distorted, DescribingFunction):
        return Study(models, distorted, tuple(omitted), validations)
    omitted.append(LeftOut("higher harmonics of the slip", distorted.reason))
    return Study(models, None, tuple(omitted), validations)


def _harmonics(found: Identification) -> DescribingFunction | NoHarmonics | NoSweep:
    run = swept_run_of(found)
    return run if isinstance(run, NoSweep) else harmonics([run])
