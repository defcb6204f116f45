"""What identification.json and comparison.json hold: their models, schema and version."""

import json
from typing import Annotated, Any, Literal

from pydantic import Field

from slipbench.protocol.configuration import Section, Unit

IDENTIFICATION_VERSION = "1.0"  # the first number changes where a reader must
COMPARISON_VERSION = "1.0"
Hertz = Annotated[float, Unit("Hz")]
Seconds = Annotated[float, Unit("s")]
RadPerSecond = Annotated[float, Unit("rad/s")]
Ratio = Annotated[float, Unit("1")]
Si = Annotated[float, Unit("SI units of output per input")]
Word = Literal["good", "usable with reservations", "not usable"]


class VerdictEntry(Section):
    """Verdict on a run.

    word     verdict
    reasons  at least one
    """

    word: Word
    reasons: Annotated[tuple[str, ...], Field(min_length=1)]


class Selected(Section):
    """Input and output that the user selected; null where they are the trial's.

    input   signal
    output  signal
    """

    input: str
    output: str


class TrialEntry(Section):
    """When the recording excited; null where it did not.

    name     of the trial file; null where it is unknown
    excited  start and end
    trip     reason of the trip; none without one
    """

    name: str | None
    excited: tuple[Seconds, Seconds]
    trip: str


class SlipEntry(Section):
    """Slip in the excitation, or in the whole recording without one; null where it is unknown.

    low                   0.5th percentile
    high                  99.5th percentile
    mean                  mean
    defined_share         share of the samples where slip is defined
    driven                how the speed of the driven axle was measured
    reference             role of the reference speed
    line_reduction_db     reduction of the first wheel order by the compensation of tooth pitch
    rolling_radius_ratio  of the driven to the reference wheel, as estimated
    """

    low: Ratio | None = None
    high: Ratio | None = None
    mean: Ratio | None = None
    defined_share: Ratio
    driven: str
    reference: str
    line_reduction_db: Annotated[float, Unit("dB")] | None
    rolling_radius_ratio: Ratio | None


class ResonanceEntry(Section):
    """Resonance of the main response.

    frequency           null where there is none
    reason              why there is none
    peak                gain at the resonance over the low-frequency gain
    low_frequency_gain  gain at the lower end of the band
    servo_bandwidth     -3 dB bandwidth of the throttle servo; null where it is outside the band
    """

    frequency: Hertz | None
    reason: str | None = None
    peak: Ratio | None = None
    low_frequency_gain: Si | None = None
    servo_bandwidth: Hertz | None = None


class ClockEntry(Section):
    """How a device clock was aligned to the bus clock.

    aligned      whether it was
    reason       why it was not
    drift_ppm    positive: the device clock runs fast
    offset       of the device clock
    latency_p50  median latency over the minimum
    latency_p99  99th percentile
    samples      number of samples used
    """

    aligned: bool
    reason: str | None = None
    drift_ppm: Annotated[float, Unit("1e-6")] | None = None
    offset: Seconds | None = None
    latency_p50: Seconds | None = None
    latency_p99: Seconds | None = None
    samples: int | None = None


class FaultEntry(Section):
    """Faulty frames of one message.

    message     name, or identifier of an unknown one
    fault       kind of fault
    count       number of frames
    first_time  of the first one
    """

    message: str
    fault: str
    count: int
    first_time: Seconds


class LeftOutEntry(Section):
    """An analysis that was not performed.

    analysis       which
    reason         why
    missing_roles  signals that it lacks
    """

    analysis: str
    reason: str
    missing_roles: tuple[str, ...]


class ModeEntry(Section):
    """A pole (damping 1) or a pair of poles.

    frequency            natural frequency
    damping              damping ratio
    frequency_deviation  standard deviation, the doubt about the order included
    damping_deviation    standard deviation; 0 for a real pole
    """

    frequency: Hertz
    damping: Ratio
    frequency_deviation: Hertz
    damping_deviation: Ratio


class OrderEntry(Section):
    """A model order that was tried.

    poles             number of poles
    zeros             number of zeros
    nats              AIC above the least, in nats
    chi_square_ratio  chi-square per degree of freedom
    """

    poles: int
    zeros: int
    nats: float
    chi_square_ratio: float


class ModelEntry(Section):
    """Transfer function with dead time: gain prod(s - zeros) / prod(s - poles) e^(-s delay).

    input             role
    output            role
    poles             pairs of real and imaginary part
    zeros             pairs of real and imaginary part
    gain              factor
    delay             dead time
    delay_interval    95 % interval of the dead time; null where it is not identified
    chi_square_ratio  chi-square per degree of freedom
    freedom           degrees of freedom
    probability       of so large a chi-square if the model is right
    adequate          whether the chi-square test passes at 1 %
    drift             of the slow dynamics below the band, and its standard deviation
    modes             natural frequencies and damping ratios
    orders            every order that was tried, the least AIC first
    words             what has to be known before the model is used
    """

    input: str
    output: str
    poles: tuple[tuple[RadPerSecond, RadPerSecond], ...]
    zeros: tuple[tuple[RadPerSecond, RadPerSecond], ...]
    gain: float
    delay: Seconds
    delay_interval: tuple[Seconds, Seconds] | None
    chi_square_ratio: float
    freedom: int
    probability: Ratio
    adequate: bool
    drift: tuple[RadPerSecond, RadPerSecond]
    modes: tuple[ModeEntry, ...]
    orders: tuple[OrderEntry, ...]
    words: tuple[str, ...]


class CorrelationEntry(Section):
    """A residual test.

    probability  of so much correlation by chance, over all lags
    passed       whether it is at least 1 %
    bound        that 95 % of the correlations are below, each by itself
    largest      correlation coefficient
    """

    probability: Ratio
    passed: bool
    bound: Ratio
    largest: Ratio


class ResidualEntry(Section):
    """Residual tests over the lines of a band; null where the record is too short.

    band               lowest and highest frequency
    lines              number of lines
    whiteness          autocorrelation of the residual
    cross_correlation  of residual and input
    """

    band: tuple[Hertz, Hertz]
    lines: int
    whiteness: CorrelationEntry
    cross_correlation: CorrelationEntry


class ValidationEntry(Section):
    """A model on held-out data.

    input           role
    output          role
    run             name of the run
    held_out        which data were held out
    nrmse_fit       100 (1 - |measured - model| / |measured - mean|), in the band
    error           root mean square of the residual, in the output's SI unit
    missing         share of the output that depends on the input and is not in the model
    residual_tests  tests of the residual
    """

    input: str
    output: str
    run: str
    held_out: str
    nrmse_fit: Annotated[float, Unit("%")]
    error: float
    missing: Ratio
    residual_tests: ResidualEntry | None


class ResponseEntry(Section):
    """A frequency response, in SI units of output per input.

    input      role
    output     role
    method     how it was estimated
    frequency  lines
    gain       at each line
    phase      at each line
    coherence  at each line
    deviation  standard deviation of the complex value at each line
    """

    input: str
    output: str
    method: str
    frequency: tuple[Hertz, ...]
    gain: tuple[Si | None, ...]
    phase: tuple[Annotated[float, Unit("rad")] | None, ...]
    coherence: tuple[Ratio | None, ...]
    deviation: tuple[Si | None, ...]


class IdentificationFile(Section):
    """Results of `slipbench identify RUN` in SI units. Numbers that are not finite are null.

    schema_version  version of this format
    recording       name of the run folder
    duration        of the recording
    headline        main result in words
    reliable_band   widest band without an unreliable line
    coherence_min   least coherence in it
    delays          encoder: mean age of the encoder speed; input_to_slip, or input_to_output where
                    another output was selected: low-frequency group delay of the main response
    clocks          by device
    warnings        of the recording
    """

    schema_version: Literal["1.0"]
    recording: str
    duration: Seconds
    headline: str
    verdict: VerdictEntry | None
    selected: Selected | None
    trial: TrialEntry | None
    slip: SlipEntry | None
    resonance: ResonanceEntry
    reliable_band: tuple[Hertz, Hertz] | None
    coherence_min: Ratio | None
    delays: dict[str, Seconds]
    clocks: dict[str, ClockEntry]
    faults: tuple[FaultEntry, ...]
    warnings: tuple[str, ...]
    left_out: tuple[LeftOutEntry, ...]
    models: tuple[ModelEntry, ...]
    validations: tuple[ValidationEntry, ...]
    responses: tuple[ResponseEntry, ...]


class ComparedEntry(Section):
    """A run of the comparison.

    run       name
    compared  whether it has the response that is compared
    """

    run: str
    verdict: VerdictEntry
    compared: bool


class PooledEntry(Section):
    """Frequency response pooled over the runs, in SI units of output per input.

    input      role
    output     role
    frequency  lines
    real       real part at each line
    imaginary  imaginary part at each line
    coherence  at each line
    deviation  standard deviation of the complex value at each line
    quantile   two-sided 95 % quantile that belongs to the deviation
    method     how it was pooled
    stride     lines from one to the next that shares no noise with it
    """

    input: str
    output: str
    frequency: tuple[Hertz, ...]
    real: tuple[Si, ...]
    imaginary: tuple[Si, ...]
    coherence: tuple[Ratio, ...]
    deviation: tuple[Si, ...]
    quantile: float
    method: str
    stride: int


class DifferenceEntry(Section):
    """A run against the pooled response of the others.

    run          name
    distance     root mean square of the difference over the gain
    expected     the same from noise and the scatter of the others
    probability  of such a distance by chance, corrected for the number of runs (Holm)
    significant  whether it is below 5 %
    lines        independent lines that were compared
    """

    run: str
    distance: Ratio
    expected: Ratio
    probability: Ratio
    significant: bool
    lines: int


class ParameterEntry(Section):
    """A parameter in every run that is compared.

    name         of the parameter
    unit         of values and deviations
    values       in the order of the runs; null where a run does not have it
    deviations   standard deviations
    probability  of so different values by chance, corrected for the number of parameters (Holm)
    """

    name: str
    unit: str
    values: tuple[float | None, ...]
    deviations: tuple[float | None, ...]
    probability: Ratio | None


class AcrossEntry(Section):
    """A model on the data of another run.

    model      run of the model
    data       run of the data
    nrmse_fit  NRMSE fit
    error      root mean square of the residual, in the output's SI unit
    """

    model: str
    data: str
    nrmse_fit: Annotated[float, Unit("%")]
    error: float


class ComparisonFile(Section):
    """Results of `slipbench identify RUN RUN ...`. Numbers that are not finite are null.

    schema_version  version of this format
    headline        main result in words
    input           role
    output          role
    """

    schema_version: Literal["1.0"]
    headline: str
    input: str
    output: str
    runs: tuple[ComparedEntry, ...]
    pooled: PooledEntry
    differences: tuple[DifferenceEntry, ...]
    parameters: tuple[ParameterEntry, ...]
    validation: tuple[AcrossEntry, ...]


FILES: dict[str, type[Section]] = {
    "identification": IdentificationFile,
    "comparison": ComparisonFile,
}


def schema(name: str) -> dict[str, Any]:
    """JSON schema (draft 2020-12) of a file: "identification" or "comparison"."""
    made = FILES[name].model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **made}


def schema_text(name: str) -> str:
    """JSON schema as text of a file."""
    return json.dumps(schema(name), indent=1) + "\n"
