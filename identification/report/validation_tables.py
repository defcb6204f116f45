"""Validation of models as table rows and as a tree for identification.json."""

from typing import Any

from slipbench.identification.models.residual_tests import CorrelationTest, NoTests
from slipbench.identification.models.validation import Validation
from slipbench.identification.report.words import name, p_value, shown_deviation

Rows = list[tuple[str, str]]


def title(of: Validation) -> str:
    """Heading of a validation: input and output of the model."""
    return f"{name(of.input)} to {name(of.output)}".capitalize()


def rows(of: Validation) -> Rows:
    """Rows: held-out data, NRMSE fit, error, residual tests with their meaning."""
    return [
        ("Held-out data", f"{of.held_out}; run {of.run}"),
        ("NRMSE fit", f"{of.fit:.1f} %; below the band nothing is compared"),
        ("RMS error", shown_deviation(of.error, of.unit, of.stated)),
        *_tests(of),
    ]


def _tests(of: Validation) -> Rows:
    tests = of.tests
    if isinstance(tests, NoTests):
        return [("Residual tests", f"not performed: {tests.reason}")]
    return [
        (
            "Cross-correlation with the input",
            _said(
                tests.cross_correlation,
                "no significant unmodelled dynamics",
                f"the residual depends on the input: the model lacks dynamics of about"
                f" {100 * of.missing:.1f} % of the output",
            ),
        ),
        (
            "Whiteness",
            _said(
                tests.autocorrelation,
                "the noise is white in the band",
                "the noise has dynamics of its own, which the model does not describe; its intervals do"
                " not assume white noise",
            ),
        ),
    ]


def _said(test: CorrelationTest, passed: str, failed: str) -> str:
    word, meaning = ("passed", passed) if test.passed else ("failed", failed)
    return f"{word} ({p_value(test.probability)}): {meaning}"


def figures(of: Validation) -> dict[str, Any]:
    """Validation as a tree in SI units."""
    tests = of.tests
    return {
        "input": of.input,
        "output": of.output,
        "run": of.run,
        "held_out": of.held_out,
        "nrmse_fit": of.fit,
        "error": of.error,
        "missing": of.missing,
        "residual_tests": None
        if isinstance(tests, NoTests)
        else {
            "band": list(tests.band),
            "lines": tests.lines,
            "whiteness": _test(tests.autocorrelation),
            "cross_correlation": _test(tests.cross_correlation),
        },
    }


def _test(of: CorrelationTest) -> dict[str, Any]:
    return {
        "probability": of.probability,
        "passed": of.passed,
        "bound": of.bound,
        "largest": float(of.value.max()),
    }
