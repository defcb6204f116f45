"""Published benchmarks: their split, what is given, and the figures of publications.

The splits are those of the official loader of nonlinearbenchmark.org (package nonlinear_benchmarks,
functions Silverbox, Cascaded_Tanks and CED): training data, test data, and the number of first
samples of a test from which the initial state may be estimated. Errors are root mean square errors
of the simulation over the other samples of the test.
"""

from dataclasses import dataclass

SOURCES = {
    "Champneys 2024": "M. D. Champneys, G. I. Beintema, R. Toth, M. Schoukens and T. J. Rogers, Baseline"
    " Results for Selected Nonlinear System Identification Benchmarks, IFAC-PapersOnLine 58(15), 2024",
    "SysIdentPy": "documentation of SysIdentPy, tutorials silver-box-system and coupled-eletric-device",
    "Cruz 2025": "G. G. Cruz, B. Renczes, M. C. Runacres and J. Decuyper, State-Space Kolmogorov Arnold"
    " Networks for Interpretable Nonlinear System Identification, arXiv:2506.16392, table I",
    "Kilic 2025": "A. Kilic and K. Batselier, A Fully Probabilistic Tensor Network for Regularized"
    " Volterra System Identification, arXiv:2511.20457, table 1",
}
"""By the short names that the tables use."""


@dataclass(frozen=True)
class Test:
    """A test of a benchmark. run: a segment in s, as in run@0:60."""

    name: str
    run: str


@dataclass(frozen=True)
class Figure:
    """A published error on a test, in the benchmark's unit; source: in which it was read, of SOURCES."""

    test: str
    value: float
    method: str
    source: str


@dataclass(frozen=True)
class Benchmark:
    """A published benchmark.

    runs: captures to import. training, held_out: segments of the published training data; the test
    data are used for nothing but the error. first: samples of a test that may set the initial
    state. unit, factor: of errors, and how many of it are one SI unit. split: in words; publication:
    of the data; note: what a reader must know of the figures.
    """

    name: str
    title: str
    model: str
    training: tuple[str, ...]
    held_out: tuple[str, ...]
    tests: tuple[Test, ...]
    first: int
    unit: str
    factor: float
    publication: str
    split: str
    figures: tuple[Figure, ...]
    note: str = ""


BENCHMARKS = (
    Benchmark(
        "silverbox",
        "Silverbox",
        "silverbox",
        ("silverbox@70:71.5", "silverbox@90:91.5"),
        ("silverbox@110:112",),
        (
            Test("multisine", "silverbox@173.1983:208.7315"),
            Test("arrow, full", "silverbox@0.1638:66.4772"),
            Test("arrow, no extrapolation", "silverbox@0.1638:52.5918"),
        ),
        50,
        "mV",
        1e3,
        "T. Wigren and J. Schoukens, Three free data sets for development and benchmarking in nonlinear"
        " system identification, ECC 2013",
        "Training: samples 40650 to 105711 (106.6 s; 5 s of them are used here, 3 s for the fit and 2 s"
        " held out). Tests: samples 105712 to 127399 (multisine), 100 to 40574 (arrow, full), 100 to"
        " 32099 (arrow, no extrapolation).",
        (
            Figure("multisine", 7.73, "polynomial NARX", "SysIdentPy"),
            Figure("arrow, full", 4.15, "polynomial NARX", "SysIdentPy"),
            Figure("arrow, no extrapolation", 2.23, "polynomial NARX", "SysIdentPy"),
            Figure("arrow, full", 13.5, "best linear approximation", "Cruz 2025"),
            Figure("arrow, full", 3.9, "state-space KAN, grey box", "Cruz 2025"),
            Figure("arrow, full", 1.4, "deep encoder, quoted", "Cruz 2025"),
            Figure("arrow, full", 0.3, "polynomial nonlinear state space, quoted", "Cruz 2025"),
        ),
        "Cruz 2025 states a test of 40 000 samples; whether these are exactly the samples of the"
        " loader is not verified.",
    ),
    Benchmark(
        "cascaded_tanks",
        "Cascaded tanks with overflow",
        "cascaded_tanks",
        ("tanks_est@0:2800",),
        ("tanks_est@2800:",),
        (Test("test record", "tanks_val"),),
        50,
        "V",
        1.0,
        "M. Schoukens, P. Mattsson, T. Wigren and J.-P. Noel, Cascaded tanks benchmark combining soft"
        " and hard nonlinearities, Workshop on Nonlinear System Identification Benchmarks, Brussels 2016",
        "Training: the estimation record, 1024 samples (700 for the fit, 324 held out, as"
        " Champneys 2024 splits it). Test: the validation record, 1024 samples.",
        (
            Figure("test record", 0.66, "Volterra, BMVALS", "Kilic 2025"),
            Figure("test record", 0.54, "regularized Volterra, quoted", "Kilic 2025"),
            Figure("test record", 0.51, "Volterra, BTN-V (mean of 10 runs)", "Kilic 2025"),
            Figure("test record", 0.48, "Volterra, SED-MPK, quoted", "Kilic 2025"),
        ),
        "The number of first samples which these publications leave out of the error is not verified."
        " Lower errors have been published; their figures could not be verified, so they are not quoted.",
    ),
    Benchmark(
        "coupled_drives",
        "Coupled electric drives",
        "coupled_drives",
        ("drives_uniform1@0:5.6", "drives_uniform2@0:5.6"),
        ("drives_uniform1@5.6:8", "drives_uniform2@5.6:8"),
        (Test("low input", "drives_uniform1@8:"), Test("high input", "drives_uniform2@8:")),
        10,
        "V",
        1.0,
        "T. Wigren and M. Schoukens, Coupled Electric Drives Data Set and Reference Models, technical"
        " report 2017-024, Uppsala University, 2017",
        "Training: the first 400 samples of both records with uniform noise (280 for the fit, 120 held"
        " out, of each). Tests: the last 100 samples of each.",
        (
            Figure("low input", 0.113, "polynomial NARX, degree 2", "SysIdentPy"),
            Figure("high input", 0.106, "polynomial NARX, degree 2", "SysIdentPy"),
            Figure("low input", 0.097, "polynomial NARX, degree 3", "SysIdentPy"),
            Figure("high input", 0.073, "polynomial NARX, degree 3", "SysIdentPy"),
        ),
        "The published models are fitted to each record alone; degree 3 was chosen with the test error"
        " known. The same tutorial quotes 0.0945 V, the mean of both tests, as the best of Champneys 2024,"
        " which was not verified there. Ours is one model for both records.",
    ),
)
