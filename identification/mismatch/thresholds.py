"""Thresholds that decide a verdict, in one place; each with its unit and what it trades.

Settings of algorithms (steps, grids, batches) are where they are used. The units are nats of
log-likelihood, prior standard deviations, or shares.
"""

# Significance.

FALSE_ALARM_RATE = 0.05
"""Family-wise rate of false alarms, over all hypotheses tested. Lower: fewer false alarms, more misses."""
LIBRARY_SHARE = 0.5
"""Share of that rate for the library; the free curves have the rest."""
JOINT_TEST_P = 0.01
"""p on the training recordings up to which held-out ones are tested jointly. Higher: costs time."""
TESTABLE = 1.0
"""Expected gain of an effect below which its test has no power and does not count, nats."""

# Acceptance of effects.

REQUIRED_GAIN = 12.0
"""Log-likelihood gain required of an effect, nats. Lower: weak effects are named, more often wrongly."""
FORMULA_SHARE = 0.05
"""Share of an effect's gain that its inexact formula may leave to others at the same injection point."""
INDISTINGUISHABLE = 10.0
"""Difference of gain up to which effects are indistinguishable, nats. Higher: longer lists of ties."""
EXCITED = 6.0
"""Expected gain of an effect of typical size above which it counts as excited, nats."""
NEGLIGIBLE_SHARE = 0.1
"""Effects below this share of the smallest size of interest are negligible."""
NEGLIGIBLE_DISC_SHARE = 0.5
"""The same share for toothed discs, which all have a manufacturing tolerance."""
PAIR_SHARE = 0.5
"""Share of the gain of a free curve that a pair of effects must reach to replace it."""

# Held-out recordings.

CONFIRMED = 5.0
"""Gain required of an effect with a strong predicted response in held-out recordings, nats."""
DOUBTFUL = 10.0
"""Factor on p where other evidence speaks for chance: effects that held-out recordings contradict,
and curves located by plain least squares, which the noise model takes for noise. Lower: more alarms
on effects of a wrong form and on coloured noise, and more by chance: one at p = 0.04 in 60 blind
cases, one at p = 0.011 in a surrogate of tanks. The two cases for which least squares were
introduced have 1e-14 and 1e-27."""
RISEN_ERROR = 1.02
"""Ratio of held-out errors above which an error has increased. 1: rejects by rounding and noise."""
LARGE_ERROR = 5.0
"""Multiple of its floor beyond which an error is large.

Innovations exclude what follows from preceding errors: for motorcycles without a missing effect,
errors are up to 2.7 times such a floor.
"""

# Free curves.

CURVE_GAIN = 15.0
"""Gain above half the number of knots from which a curve is tested, nats. Lower: costs time."""
PLAIN_SHARE = 0.8
"""Share of the gain of a detailed curve from which a curve of few knots is preferred."""
RESIDUAL_SHARE = 0.05
"""Residual share, relative to what named effects explain, up to which they are adequate."""
FURTHER_SHARE = 0.1
"""Minimum gain of a further curve or iteration, relative to the first one."""

# Calibration.

BEYOND_PRIOR = 2.0
"""Prior deviations beyond which a missing effect may have moved a parameter.

Of ten parameters whose errors follow their priors, at least one lies beyond in 37 of 100 cases; a
false alarm costs one more start of a fit.
"""
FAR_FROM_PRIOR = 3.0
"""Prior deviations beyond which calibration itself may have diverged; by chance in 3 of 100."""
HIDDEN_BY_NOISE = 0.9
"""Share of the mean square error, if predicted by the noise model, above which a wrong simulation
may be hidden. Lower: pairs are tested more often, which costs time."""
REPLACED_SHARE = 0.2
"""Share of the gain of parameters far from the file that is required of an effect in their place."""
LINE_GAIN = 12.0
"""Log-likelihood gain of a line, over all recordings, below which no angle is estimated, nats."""

# Parameters and plausibility.

UNIDENTIFIABLE = 0.7
"""Posterior over prior deviation of a shape above which it is not identifiable."""
FORMULA_WIDTH = 0.02
"""Relative 95 % half width of the difference between formulas of the same physics.

Recordings can determine a parameter more precisely than that, formulas cannot: of 42 parameters
identified in two blind validations (their generator has its own formulas), 12 were off by more than
recordings allow, 10 of them by less than 3 %.
"""
CLOCK_DRIFT = 1e-3
"""Clock drift larger than that of any device: a CAN node with more loses the bit timing of its bus."""
REST_SHARE = 0.25
"""Share of an offset above which a reading at rest deviates from zero."""
REST_TIME = 0.5
"""Time for which a reading must stay near zero to be at rest, s."""
HELD_SHARE = 0.5
"""Share of bins above which an input that keeps its value is a computed one."""
