"""Real recordings in which something is concealed: what is imported, what is explained by what."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Capture:
    """A run to import. tables: side tables by name; files are below the recordings' folder."""

    name: str
    log: str
    roles: str
    database: str = ""
    tables: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Case:
    """One analysis. known: what is known of these recordings from elsewhere.

    model: a file of trials/models, or what another case has improved, as in improved/silverbox.
    """

    name: str
    title: str
    model: str
    training: tuple[str, ...]
    held_out: tuple[str, ...]
    known: str


LINK = ("swept1-0-10hz", "swept2-0-10hz", "swept3-0-10hz", "swept7-0-10hz", "swept10-0-10hz",
        "fixed1-5hz", "fixed2-5hz", "step1", "step3")  # fmt: skip
CAPTURES = (
    Capture("r1", "yamaha_r1/session.log", "yamaha_r1", "yamaha_r1/session.dbc",
            {"gps": "yamaha_r1/gps.csv", "lean": "yamaha_r1/lean.csv"}),
    Capture("wrx", "subaru_wrx/can_sample.log", "subaru_wrx_two_loggers",
            "subaru_wrx/sample_can_spec.dbc", {"accessport": "subaru_wrx/accessport_sample.csv"}),
    *(Capture(f"link_{n}", f"flexible_link/{n}.txt", "flexible_link") for n in LINK),
    *(Capture(f"drives_prbs{k}", "coupled_drives/DATAPRBS.csv", f"coupled_drives_prbs{k}")
      for k in (1, 2, 3)),
    *(Capture(f"drives_uniform{k}", "coupled_drives/DATAUNIF.csv", f"coupled_drives_uniform{k}")
      for k in (1, 2)),
    Capture("tanks_est", "silverbox_tanks/tanque.csv", "cascaded_tanks_est"),
    Capture("tanks_val", "silverbox_tanks/tanque.csv", "cascaded_tanks_val"),
    Capture("silverbox", "silverbox_tanks/SNLS80mV.csv", "silverbox"),
)  # fmt: skip
CASES = (
    Case("r1_front_wheel", "Yamaha R1: from the front wheel to the satellites",
         "front_wheel_and_satellites", ("r1@0:209",), ("r1@209:",),
         "The rolling radius shrinks with lean (crown ratio about 0.25) and the GPS is about 0.14 s"
         " late; with both 0.72 m/s, without 1.51 m/s, sought below 0.75 m/s."),
    Case("r1_engine", "Yamaha R1: from the engine to the rear wheel", "engine_and_rear_wheel",
         ("r1@30:110",), ("r1@230:330",), "Nothing is known for certain; the gear changes."),
    Case("flexible_link", "Motor with a flexible link, taken as rigid", "rigid_link",
         ("link_swept1-0-10hz", "link_swept2-0-10hz"),
         ("link_swept7-0-10hz", "link_fixed1-5hz", "link_step1"),
         "Rigid 12.7, 14.5 and 10.2 counts on sweeps, sines and steps; with one elastic mode near"
         " 2.5 / 3.4 Hz at most 3.8, 1.4 and 2.6 are sought."),
    Case("coupled_drives", "Coupled drives, binary noise: belt and counter", "coupled_drives",
         ("drives_prbs1", "drives_prbs2"), ("drives_prbs3",),
         "The pulse counter is blind to direction and the belt is elastic, with a mode near"
         " 20 rad/s (Wigren and Schoukens, 2017)."),
    Case("coupled_drives_uniform", "Coupled drives, uniform noise: belt and counter",
         "coupled_drives", ("drives_uniform1",), ("drives_uniform2",),
         "The same drives with another input, which is 0.5 V higher in the held-out run."),
    Case("silverbox", "Silverbox: a spring taken as linear", "silverbox",
         ("silverbox@70:71.5", "silverbox@90:91.5"), ("silverbox@110:112",),
         "The spring hardens with the cube; published models reach about 0.3 mV (Schoukens and"
         " Noel, nonlinearbenchmark.org)."),
    Case("cascaded_tanks", "Cascaded tanks without an edge", "cascaded_tanks",
         ("tanks_est",), ("tanks_val",),
         "Both tanks overflow; 0.36 V is sought on the test record, published scores are 0.18 to"
         " 0.31 V (nonlinearbenchmark.org), of models that were made for it."),
    Case("wrx_accelerometer", "Subaru WRX: accelerometer and wheels", "accelerometer",
         ("wrx@0:45",), ("wrx@45:",),
         "ACCEL_LONG has the wrong sign in its database (correlation -0.96) and lags 0.15 s."),
    Case("wrx_speed", "Subaru WRX: speed and wheels", "speed_of_the_wheels",
         ("wrx@0:45",), ("wrx@45:",), "SPEED lags the wheels by 0.11 s."),
    Case("wrx_loggers", "Subaru WRX: two loggers of one drive", "two_loggers",
         ("wrx@0:45",), ("wrx@45:",),
         "The second logger is 59.94 s off. A drift of about 15 ms a minute was expected; the"
         " engine speeds do not show it (below)."),
    Case("link_control", "Control, flexible link: the improved file on recordings it never met",
         "improved/flexible_link", ("link_swept3-0-10hz", "link_swept10-0-10hz"),
         ("link_fixed2-5hz", "link_step3"), "Nothing more should be found."),
    Case("silverbox_control", "Control, Silverbox: the improved file on samples it never met",
         "improved/silverbox", ("silverbox@75:76.5", "silverbox@95:96.5"), ("silverbox@115:117",),
         "Nothing more should be found."),
    Case("wrx_control", "Control, Subaru WRX: front left against front right wheel",
         "left_and_right", ("wrx@50:70",), ("wrx@70:90",),
         "On a straight (steering within 5 degrees) the wheels differ by nothing but their radii."),
)  # fmt: skip

REMARKS = {
    "wrx_control": "A false alarm: neither an elastic transmission nor a drifting clock is "
    "there. The cause was measured afterwards. Of what is left of the right "
    "wheel after the left one, 92 to 94 % lies between 12 and 18 Hz: once per "
    "turn of a wheel that rolls 1.983 m, each wheel's reading swings by an "
    "amount of its own (left 0.027, right 0.051 m/s) and 125 degrees apart, the"
    " same over 40 s. So the wheels do differ by more than their radii, the "
    "piece is no control in that band, and what predicts one pattern best from "
    "the other is a filter, which is then named. Since then a model file may "
    "tell how far a wheel rolls in a turn (`turn`); the pattern is then looked "
    "for in each channel alone and taken out when the recording is read. That "
    "leaves 0.020 m/s of the wheels' difference of 0.053 m/s in the first piece"
    " and 0.019 in the second. The result above is from before: the analysis "
    "was not repeated with it, so that the false alarm is gone is not shown.",
    "coupled_drives": "A shortfall: neither the counter's blindness nor the belt is named. Two "
    "causes were measured afterwards. Re-calibration runs away, to a time "
    "constant of 20 s from 0.5 s +- 0.4 s: then the simulated speed has one "
    "sign, and blindness nothing to act on. And the gain of these drives is 0.8"
    " with uniform and 2 to 3 with binary noise (least squares on each alone), "
    "so that no single gain fits both kinds. On the binary recordings (the "
    "first two, each fitted alone) blindness leaves 87 and 83 % of the error of"
    " a first order without it; blindness with a mode at 20 rad/s leaves 26 and"
    " 24 %.",
    "wrx_accelerometer": "The sign is found, with a share of 0.78 instead of 1: what is told is "
    "-0.57 times the slope of the wheels' speed. A shortfall: the lag is named "
    "as a mode instead of a lag, and the square is taken for a false name. The "
    "model file has neither grade nor pitch of the body; whether they are the "
    "cause was not tested.",
    "wrx_loggers": "The offset is found to a row when the recordings are read. A drift of 15 "
    "ms a minute moves 45 s by 11 ms, an eighth of the logger's period: it is "
    "not claimed.",
    "flexible_link": "The mode is found. Two of three goals are missed: 1.70 counts instead of "
    "1.4 on sines (by a fifth) and 2.93 instead of 2.6 on steps (by an eighth)."
    " Nothing is known of a drifting clock: it is taken for a false name, of "
    "something small that is left.",
    "silverbox": "A shortfall: a cube was accepted first and then withdrawn, because a free "
    "curve still found something. 0.9 mV is three times what published models "
    "reach.",
    "r1_engine": "Held out, re-calibration alone makes it worse (1.53 instead of 0.94 m/s), "
    "and why was not investigated. The names stand for what helps, not for what"
    " is.",
    "cascaded_tanks": "Both overflows were accepted first and then withdrawn, because a free "
    "curve still found something. 0.3601 V misses 0.36 V by a hair and "
    "published scores by much; those models were made for this benchmark, this "
    "one was not.",
}
"""What a reader must know to judge a result."""
