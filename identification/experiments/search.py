"""The trial with the most expected evidence: a grid, then a pattern search about its best points."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from slipbench.identification.experiments.bounds import Bounds
from slipbench.identification.experiments.envelope import Drawn, draws, rounded, scaled_into
from slipbench.identification.experiments.evidence import Evidence, expected_evidence, rehearsed
from slipbench.identification.experiments.family import longest, menu_trials, speed_range, trials
from slipbench.identification.experiments.hypothesis import Hypothesis
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.motorcycle.menu import RPM, Choice
from slipbench.identification.mismatch.motorcycle.system import MotorcycleSystem
from slipbench.identification.mismatch.simulation.threads import in_threads
from slipbench.plant.equilibrium import equilibrium
from slipbench.plant.errors import PlantError
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.simulation import Simulation

SEED = 20
"""Of the motorcycles that are drawn."""
Say = Callable[[str], None]


@dataclass(frozen=True)
class Effort:
    """Effort of a search.

    refined: trials of the grid from which the pattern search begins; rounds: of it, in which its steps
    are halved where nothing is better; offered: trials that are held against the drawn motorcycles;
    drawn: motorcycles under each hypothesis
    """

    refined: int = 3
    rounds: int = 3
    offered: int = 3
    drawn: int = 5


THOROUGH = Effort()


@dataclass(frozen=True)
class Problem:
    """Problem that a trial is designed for.

    known: calibrated vehicle with the noise of its recordings; questions: sets of hypotheses that
    exclude each other; actuators: that may be excited
    """

    known: Fit
    questions: tuple[tuple[Hypothesis, ...], ...]
    bounds: Bounds
    actuators: tuple[str, ...] = ("throttle", "spark")

    @property
    def hypotheses(self) -> tuple[Hypothesis, ...]:
        """All hypotheses, each once."""
        return tuple({h.name: h for question in self.questions for h in question}.values())

    @property
    def motorcycle(self) -> Motorcycle:
        """The vehicle as calibrated."""
        system = self.known.model.at(self.known.point)
        assert isinstance(system, MotorcycleSystem)
        return system.vehicle.motorcycle


@dataclass(frozen=True)
class Designed:
    """A trial that stays within its bounds for each motorcycle that was simulated.

    simulated: how many those were
    """

    choice: Choice
    evidence: Evidence
    simulated: int = 0


def design(
    problem: Problem, say: Say = lambda _: None, effort: Effort | None = None
) -> list[Designed]:
    """Trials with the most expected evidence, the best first; each with its amplitude in all draws.

    effort: THOROUGH if not given. Empty where no trial fits into limits and straight, or none shows a difference.
    """
    effort = effort or THOROUGH
    likely = draws(problem.known, problem.hypotheses, 0, SEED)
    grid = [*_of_menu(problem), *trials(problem.motorcycle, problem.bounds, problem.actuators)]
    say(f"Simulating {len(grid)} trials")
    found = _best(_evaluated(problem, likely, grid))
    say(f"Refining the best {min(len(found), effort.refined)}")
    refined = [_refined(problem, likely, one, effort.rounds) for one in found[: effort.refined]]
    return _safe(problem, _best([*refined, *found]), effort, say)


def _of_menu(problem: Problem) -> list[Choice]:
    return list(menu_trials(problem.motorcycle, problem.bounds, problem.actuators))


def _evaluated(
    problem: Problem, motorcycles: Sequence[Drawn], choices: Sequence[Choice]
) -> list[Designed]:
    found = in_threads(lambda choice: evaluated(problem, motorcycles, choice), choices)
    return [one for one in found if one is not None]


def evaluated(problem: Problem, motorcycles: Sequence[Drawn], choice: Choice) -> Designed | None:
    """A trial at the largest amplitude up to its own that fits, with its evidence; None: none fits."""
    fitting = _fitted(problem, motorcycles, choice)
    if fitting is None:
        return None
    try:
        evidence = expected_evidence(rehearsed(problem.known, fitting), problem.questions)
    except (ValueError, PlantError):
        return None
    return Designed(fitting, evidence, len(motorcycles))


def _fitted(problem: Problem, motorcycles: Sequence[Drawn], choice: Choice) -> Choice | None:
    """The trial with an amplitude that its commands and the motorcycles' responses permit."""
    for drawn in motorcycles:
        try:
            simulation = Simulation(drawn.motorcycle)
            opening = equilibrium(simulation, choice.gear, choice.engine_speed)[1]
        except ValueError:
            return None
        most = problem.bounds.amplitude(choice, opening)
        if most <= 0.0:
            return None
        choice = replace(choice, amplitude=rounded(min(choice.amplitude, most)))
    return scaled_into(choice, motorcycles, problem.bounds)[0]


def _best(found: Sequence[Designed]) -> list[Designed]:
    return sorted(found, key=lambda one: -one.evidence.worth)


def _refined(
    problem: Problem, motorcycles: Sequence[Drawn], start: Designed, rounds: int
) -> Designed:
    """The best trial that a pattern search finds from a start: band, engine speed, amplitude."""
    best, size = start, 1.0
    for _ in range(rounds):
        better = _best(_evaluated(problem, motorcycles, _neighbours(problem, best.choice, size)))
        if better and better[0].evidence.worth > best.evidence.worth:
            best = better[0]
        else:
            size *= 0.5
    return best


def _neighbours(problem: Problem, choice: Choice, size: float) -> list[Choice]:
    """Trials one step away in each direction. size: share of the first step."""
    found = []
    for factor in (1.0 + 0.5 * size, 1.0 / (1.0 + 0.5 * size)):
        found.append(replace(choice, low=rounded(choice.low * factor)))
        if choice.waveform != "square":
            found.append(replace(choice, high=rounded(choice.high * factor)))
    found += [_faster(problem, choice, by) for by in (0.08 * size, -0.08 * size)]
    found.append(replace(choice, amplitude=rounded(choice.amplitude * (1.0 - 0.5 * size))))
    return [one for one in found if _meant(problem, one)]


def _faster(problem: Problem, choice: Choice, by: float) -> Choice:
    """The trial at another engine speed within its range, as long as fits there."""
    bike, bounds = problem.motorcycle, problem.bounds
    low, high = speed_range(bike, choice.gear, bounds)
    speed = min(max(choice.engine_speed * (1.0 + by), low), high)
    speed = round(speed / RPM / 10.0) * 10.0 * RPM
    seconds = longest(bike, choice.gear, speed, bounds)
    return replace(choice, engine_speed=speed, seconds=seconds)


def _meant(problem: Problem, choice: Choice) -> bool:
    """Whether a band lies within the band of the commands and the resolution of the duration."""
    highest = min(problem.bounds.highest, 25.0)
    if choice.waveform == "square":
        return 2.0 / choice.seconds <= choice.low <= highest / 4.0
    least = 3.0 / choice.period if choice.waveform == "multisine" else 1.0 / choice.seconds
    return least <= choice.low < 0.7 * choice.high and choice.high <= highest


def _safe(problem: Problem, found: Sequence[Designed], effort: Effort, say: Say) -> list[Designed]:
    """Trials at the amplitude that all drawn motorcycles permit, the best first."""
    motorcycles = draws(problem.known, problem.hypotheses, effort.drawn, SEED)
    say(f"Simulating {len(motorcycles)} motorcycles within their intervals")
    safe = list[Designed]()
    for one in found:
        there = evaluated(problem, motorcycles, one.choice)
        if there is not None and there.evidence.worth > 0.0:
            safe.append(there)
        if len(safe) == effort.offered:
            break
    return _best(safe)
