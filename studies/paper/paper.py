"""The paper's identification, step by step, on recordings over CAN.

Corno and Savaresi, "Experimental Identification of Rear Wheel Slip Dynamics of a Motorbike", IFAC
SYSID 2009. Each step is a function from what was identified to a section with figures and claims.

    made = paper(found, Context(nominal.motorcycle, 2 * math.pi * 10))
    made.answer, made.claims
"""

from dataclasses import dataclass

from slipbench.studies.paper.actuator_section import actuators, paper_answer, throttle_or_spark
from slipbench.studies.paper.claims import Claim
from slipbench.studies.paper.context import Context, Found
from slipbench.studies.paper.encoder_section import encoder, wheel_lines
from slipbench.studies.paper.filter_section import filtering
from slipbench.studies.paper.harmonic_section import describing_functions, trials
from slipbench.studies.paper.multisine_section import multisine
from slipbench.studies.paper.paper_section import Section
from slipbench.studies.paper.rational_section import rational, studies_of, time_domain
from slipbench.studies.paper.speed_section import scheduled, uncertainty
from slipbench.studies.paper.switched_section import switched


@dataclass(frozen=True)
class Paper:
    """Answer to the paper's question, and sections in the paper's order."""

    answer: str
    sections: tuple[Section, ...]

    @property
    def claims(self) -> tuple[Claim, ...]:
        """Claims of all sections."""
        return tuple(claim for section in self.sections for claim in section.claims)


def paper(found: Found, context: Context) -> Paper:
    """Sections of all steps in the paper's order, then those beyond it."""
    studies = studies_of(found, context)
    compared = actuators(found, studies, context)
    sections = (
        encoder(context),
        wheel_lines(found),
        filtering(found, context),
        trials(found),
        describing_functions(found, context),
        rational(found, studies, context),
        time_domain(found, studies, context),
        switched(found, context),
        throttle_or_spark(compared),
        scheduled(found),
        uncertainty(found, context),
        multisine(found, context),
    )
    return Paper(paper_answer(compared), sections)
