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
    also: pieces that the analysis never meets; errors on them are measured when all is done.
    """

    name: str
    title: str
    model: str
    training: tuple[str, ...]
    held_out: tuple[str, ...]
    known: str
    also: tuple[str, ...] = ()


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
NOTHING = "Nothing more should be found."
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
         " Noel, nonlinearbenchmark.org).", also=("silverbox@0:65.4",)),
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
    Case("r1_control", "Control, Yamaha R1: the improved file on a part it never fitted",
         "improved/r1_front_wheel", ("r1@209:314",), ("r1@314:",), NOTHING),
    Case("link_control", "Control, flexible link: the improved file on recordings it never met",
         "improved/flexible_link", ("link_swept3-0-10hz", "link_swept10-0-10hz"),
         ("link_fixed2-5hz", "link_step3"), NOTHING),
    Case("drives_control", "Control, coupled drives: the improved file on a run it never fitted",
         "improved/coupled_drives", ("drives_prbs3@0:5",), ("drives_prbs3@5:",), NOTHING),
    Case("silverbox_control", "Control, Silverbox: the improved file on samples it never met",
         "improved/silverbox", ("silverbox@75:76.5", "silverbox@95:96.5"), ("silverbox@115:117",),
         NOTHING),
    Case("tanks_control", "Control, cascaded tanks: the improved file on a run it never fitted",
         "improved/cascaded_tanks", ("tanks_val@0:2000",), ("tanks_val@2000:",), NOTHING),
    Case("wrx_control", "Control, Subaru WRX: front left against front right wheel",
         "left_and_right", ("wrx@50:70",), ("wrx@70:90",),
         "On a straight (steering within 5 degrees) the wheels differ by nothing but their radii."),
)  # fmt: skip

REMARKS = {
    "r1_engine":
    "Held out, re-calibration alone makes it worse (1.53 instead of 0.94 m/s), and "
    "why was not investigated. The names stand for what helps, not for what is.",
    "flexible_link":
    "The mode is found. Two of three goals are missed: 1.70 counts instead of 1.4 "
    "on sines (by a fifth) and 2.93 instead of 2.6 on steps (by an eighth). Nothing"
    " is known of a drifting clock: it is taken for a false name, of something "
    "small that is left. The cause was measured afterwards: fits stayed where they "
    "began. Begun by plain least squares, two modes near 16 rad/s and a delay of "
    "the torque of 3.9 ms leave 2.02, 1.06 and 0.60 counts on the held-out sweep, "
    "sine and step, within all three goals. That was found by hand, effect by "
    "effect, with fits of the kind that `explain` has since; that `explain` finds it "
    "by itself is not shown, for the section was not run again.",
    "coupled_drives":
    "Not run on the whole library. With four kinds of effects to choose from "
    "(direction_blind, elastic_transmission, asymmetry, quadratic, at every place) "
    "both are accepted together: direction_blind at counter, share 1.00, with "
    "elastic_transmission at voltage, 20.5 rad/s, damping 0.15; 339 nats, 0.81 and "
    "2.09 V with the blindness alone become 0.34 and 0.81 V on the training runs. "
    "Then the names are withdrawn, because a free curve still finds a push at the "
    "speed's rate along the voltage, the same for both signs and growing with its "
    "size; held out 0.58 V nominal, 0.45 re-calibrated, 0.54 with both. It is "
    "there: by least squares on each run alone, with blindness and a mode, the gain"
    " of these drives is 1.28, 2.00 and 3.03 at 0.5, 1.0 and 1.5 V. On synthetic "
    "drives whose truth is known both are named "
    "(tests/identification/test_drives.py). Before, with binary and uniform noise "
    "taken together, whose gains differ by two to three times, nothing was found.",
    "coupled_drives_uniform":
    "Not run.",
    "silverbox":
    "The result is from before, with the input along lines between samples. A cube "
    "was accepted first and then withdrawn, because a free curve still found "
    "something, and 0.9 mV is three times what published models reach. The cause "
    "was measured afterwards: lines take sinc^2 of an input that was filtered "
    "before it was sampled. Along cubics, which the model file has since, a cube of"
    " the deflection (3.9 1/V^2) and an offset of the drive (-5.4 mV) fitted to one"
    " piece of 1.5 s leave 0.46 mV held out, instead of 0.93 mV along lines; with "
    "an offset of the sensor or a square as well, 0.36 mV. Fitted by hand; "
    "`explain` was not run again.",
    "cascaded_tanks":
    "Both overflows were accepted first and then withdrawn, because a free curve "
    "still found something. 0.3601 V misses 0.36 V by a hair and published scores "
    "by much; those models were made for this benchmark, this one was not. Tried by"
    " hand since: both overflows with a cube at the sensor leave 0.305 V, with a "
    "dead zone there 0.349 V, with an offset there 0.371 V. Which of them is the "
    "physics these recordings did not tell.",
    "wrx_accelerometer":
    "The result is of a model file in which the road does not fall; the figure of "
    "that run was not kept. The sign is found; the delay is told as an offset of "
    "the clock, and the gain with the steering is taken for a false name. With "
    "gravity along the road as a slow unknown and the noise of the wheels' slope "
    "told, as the model file has it since, and eight kinds of effects to choose "
    "from (reversed_sign, lag, delay, sensor_delay, clock_offset, "
    "elastic_transmission, quadratic, scale): reversed_sign share 0.99 [0.88, "
    "1.00], sensor_delay 0.137 s [0.129, 0.145], quadratic -0.19 1/(m/s^2); held "
    "out 0.26 instead of 2.30 m/s^2, floor 0.09. The square is taken for a false "
    "name: nothing is known of its cause. The whole library was not run again.",
    "wrx_loggers":
    "The offset is found to a row when the recordings are read. Drift: against the "
    "engine speed on the bus the second logger's lies -4, -4, -4, -8, -4 and +16 ms"
    " in six pieces of 15 s; least squares over all of it give 1.6 +- 0.5 ms a "
    "minute. So 15 ms a minute are not in these engine speeds, and nothing is the "
    "right answer. That they would be found is tested: with 15 ms a minute put into"
    " the logger's clock, the first 45 s tell clock_drift 2.6e-4 [1.9e-4, 3.4e-4], "
    "where 2.5e-4 was put in (tests/real/test_explain_recordings.py).",
    "wrx_control":
    "Of what was left of the right wheel after the left one, 92 to 94 % lay between"
    " 12 and 18 Hz: once per turn of a wheel that rolls 1.983 m, each wheel's "
    "reading swings by an amount of its own. That pattern is taken out on reading "
    "(`turn`). What remained, a drifting clock, was the noise of the left wheel: "
    "the best predictor of the right wheel is a smoothed left one. Since the model "
    "file tells that noise, nothing is found, as it should be. The figure of that "
    "run was not kept.",
}  # fmt: skip
"""What a reader must know to judge a result."""
