"""The page beside an exported controller: how to connect it, and what the control unit lacks."""

from slipbench.identification.ecu.exported_law import ExportedLaw
from slipbench.identification.ecu.lua_script import GIVEN_BACK
from slipbench.identification.ecu.rusefi import SLIP_SENSOR, SPEED_SENSOR
from slipbench.identification.ecu.traction_table import TractionTable

ADDED = """\
The table has negative numbers, for firmware that *adds* them. Newer firmware ignores negative
numbers."""
SUBTRACTED = """\
The table has positive numbers, for firmware that *subtracts* them. Never load it into firmware that
adds them: there it opens the throttle when the wheel spins."""
CHECK = """\
rusEFI changed the sign in the course of 2026 (traction_control.cpp). Check it before you ride: with
the engine off, hold the pedal open and turn the driven wheel alone; the throttle target must fall.
Check a timing table on a stand, with the engine running: the timing must be retarded."""


def notes(law: ExportedLaw, table: TractionTable | None, convention: str | None) -> str:
    """Text of the page (Markdown)."""
    parts = [_head(law), _connect(law), _lacks(law), _safety(law)]
    if table is not None:
        parts.insert(2, _table(table, ADDED if convention == "added" else SUBTRACTED))
    return "\n\n".join(parts) + "\n"


def loss_of_phase(law: ExportedLaw) -> float | None:
    """Phase margin that the slower tick costs at the designed bandwidth, deg; None: not stated.

    A held command is half a tick old on average: the design counted half a period.
    """
    bandwidth = law.file.designed.get("bandwidth_hz")
    if not isinstance(bandwidth, float | int):
        return None
    return 360.0 * float(bandwidth) * 0.5 * (law.tick - law.file.period)


def _head(law: ExportedLaw) -> str:
    return f"""# Slip control `{law.file.name}` on rusEFI

`slip_control.lua` runs the control law of the controller file every {1000 * law.tick:g} ms, and reduces
{_actuators(law)} where the slip is above {100 * law.target:g} %."""


def _connect(law: ExportedLaw) -> str:
    return f"""## Connect

1. Wheel speeds: the driven wheel is the first source of the slip ratio, the free wheel the second and
   the vehicle speed. `{SLIP_SENSOR}` must be 1.00 while rolling, above 1 with slip. Correct it by the
   rolling radii: an error of 1 % is 1 % of slip.
2. Load the script on the Lua page. Leave rusEFI's own traction control tables at zero while it runs.
3. With the engine off, turn the wheels by hand; log `{SLIP_SENSOR}`, `{SPEED_SENSOR}`, the throttle
   target and the timing.
4. Replay a log first: `slipbench export-controller ... --replay RUN`."""


def _table(table: TractionTable, convention: str) -> str:
    return f"""## Table

`{table.name}.table` has the static part of the law for rusEFI's own traction control, without the
script: load it in TunerStudio by *File, Load table*. {convention} {CHECK}
It has whole numbers and slip in steps of 1 %: {_levels(table)}. Firmware before mid-2026 may read the
two axes interchanged (github.com/rusefi/rusefi/issues/9245): compare with a log."""


def _levels(table: TractionTable) -> str:
    levels = sorted({f"{x:g}" for x in table.drop.ravel()}, key=float)
    return f"{len(levels)} different drops, {levels[0]} to {levels[-1]}"


def _lacks(law: ExportedLaw) -> str:
    return f"""## What rusEFI does not carry

- **Rate.** The law was designed for {1000 * law.file.period:g} ms. {_rate(law)}
  Lua has a low priority: under load its ticks are later still, and the script cannot measure that.
- **Delay.** The design counted the sensors and the throttle of the motorcycle that was identified. The
  script gets slip from rusEFI's speed sensors, with their own filter and delay, and moves the throttle
  by rusEFI's position control. Identify again with this control unit before you rely on the margins.
- **Tooth-pitch errors.** The bench learns and corrects them; rusEFI does not.
- **Memory and time.** The shipped controllers need 8 kB (PID) to 18 kB (mixed) in a 64-bit interpreter,
  and less on the control unit. Some boards have 18 kB for Lua, most of it taken before a script is
  loaded (github.com/rusefi/rusefi/issues/7085). rusEFI prints its heap usage: check it after loading.
  The time of a tick was not measured on a control unit.
- **Precision.** Numbers are single precision; `--replay` measures the difference.
- **Governor and prefilter.** They shape a moving setpoint; here it is constant, so neither is exported.
- **The table has no dynamics**: no integral, no anti-windup, no filter, no limit of the rate. A slip
  above the setpoint remains. The stated margins do not hold for it."""


def _rate(law: ExportedLaw) -> str:
    loss, margin = loss_of_phase(law), law.file.designed.get("phase_margin_deg")
    if loss is None or not isinstance(margin, float | int):
        return "The file does not state its margins, so their loss is not known."
    return (
        f"{1000 * law.tick:g} ms cost about {loss:.0f} of its {margin:.0f} deg phase margin;"
        f" `slipbench design --period {1000 * law.tick:g}` designs for this tick."
    )


def _safety(law: ExportedLaw) -> str:
    timing = (
        ""
        if law.file.actuator == "throttle"
        else """
- rusEFI keeps the last timing offset without a limit of time: if the script stops, the retard stays
  until the control unit is reset."""
    )
    return f"""## Limits and faults

- The script only reduces: offsets are within {_limits(law)}, and change no faster than the design says.
- Unknown slip (a sensor not valid, below 3 m/s, or below -3 %): offsets are held for {GIVEN_BACK:g} s,
  then go to zero.
- rusEFI drops a throttle offset that is older than 0.2 s by itself.{timing}
- There is no button, no trip and no safety gate as on the bench. Review the limits with the rider."""


def _limits(law: ExportedLaw) -> str:
    file = law.file
    throttle = file.mixed.throttle if file.mixed else file.limits
    parts = []
    if file.actuator != "spark":
        parts.append(f"{100 * throttle.low:g} to 0 % of throttle")
    if file.actuator != "throttle":
        parts.append(f"{57.29578 * file.limits.low:.1f} to 0 deg of spark advance")
    return " and ".join(parts)


def _actuators(law: ExportedLaw) -> str:
    return {"throttle": "the throttle", "spark": "the spark advance"}.get(
        law.file.actuator, "throttle and spark advance"
    )
