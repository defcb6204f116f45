"""The model of one response that an engineer may take away, or the reason why there is none.

    found = recommended(response)               # Recommended or NoRational
    found.fit.model.to_control(), found.delay, found.words

The order is that of least description length. Lags and springs in a chain have no zeros, and only
without zeros does a recording determine a dead time; so a chain is taken where the data do not reject
it, and zeros are let in where they reject every chain. What was taken for granted is in `words`.
"""

from dataclasses import dataclass

from slipbench.identification.models.delay_profile import DelayProfile, NoDelay, delay_profile
from slipbench.identification.models.model_order import OrderChoice, choose_order, doubted, ranked
from slipbench.identification.models.rational_ml import RationalFit
from slipbench.identification.response.independent_lines import Lines, NoRational, independent_lines
from slipbench.identification.response.response import FrequencyResponse

REJECTED = 0.01  # probability of so large a chi-square under which a model is rejected


@dataclass(frozen=True)
class Recommended:
    """A rational function behind a delay, with all that it was chosen among.

    response  that it was fitted to
    choice    all candidate orders, the least AIC first
    fit       the one that is recommended
    delay     with its interval, over all orders that the data do not distinguish
    chain     whether zeros were not needed
    """

    response: FrequencyResponse
    choice: OrderChoice[RationalFit]
    fit: RationalFit
    delay: DelayProfile | NoDelay
    chain: bool

    @property
    def adequate(self) -> bool:
        """Whether the residual may be noise alone."""
        return self.fit.adequate >= REJECTED

    @property
    def words(self) -> tuple[str, ...]:
        """What has to be known before the model is used, a sentence each."""
        return (*_form(self), *_misfit(self), *_doubt(self), *_band(self.fit.lines))


def recommended(response: FrequencyResponse) -> Recommended | NoRational:
    """Choose order, model and delay for one response."""
    lines = independent_lines(response)
    if isinstance(lines, NoRational):
        return lines
    everything = choose_order(lines)
    chains = [row for row in everything.rows if not row.order.zeros]
    only = ranked(chains) if chains else everything
    chain = bool(chains) and only.best_by_mdl.fit.adequate >= REJECTED
    choice = only if chain else everything
    return Recommended(response, everything, doubted(choice), delay_profile(choice), chain)


def _form(of: Recommended) -> tuple[str, ...]:
    if of.chain:
        return (
            "The dead time is estimated without zeros, for lags and springs in series: zeros and dead "
            "time are confounded in this band, and the data need no zero.",
        )
    zeros = of.fit.model.right_zeros
    right = f", {zeros.size} of them on the right" if zeros.size else ""
    return (f"A model without zeros does not fit the data; {of.fit.order}{right}.",)


def _misfit(of: Recommended) -> tuple[str, ...]:
    if of.adequate:
        return ()
    return (
        f"The residual test rejects the model: chi-square is {of.fit.chi_square_ratio:.1f} times its "
        "degrees of freedom. Its intervals are widened by as much; curvature, an order above those "
        "tried or noise that changed in the trial may be the cause.",
    )


def _doubt(of: Recommended) -> tuple[str, ...]:
    if isinstance(of.delay, NoDelay):
        return (f"No dead time is given: {of.delay.reason}.",)
    reach = 1 / of.fit.lines.frequency[-1]
    if of.delay.high - of.delay.low > reach / 10:
        return (
            "Other plausible model orders have other dead times: a pole well above the band cannot be "
            "distinguished from dead time. A wider band narrows the interval.",
        )
    return ()


def _band(lines: Lines) -> tuple[str, ...]:
    low, high = lines.frequency[0], lines.frequency[-1]
    return (f"The model is fitted from {low:.2g} to {high:.3g}\u00a0Hz; beyond, it is a guess.",)
