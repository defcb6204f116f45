"""The Lua script that rusEFI runs: slip from two wheel speeds, the law, throttle and spark offsets.

Slip is unknown where a sensor is not valid, below 3 m/s, and where it is further below zero than
drive can make it. Then the offsets are held; after `GIVEN_BACK` they go to zero, and the law starts
again when the slip is known. rusEFI forgets an old throttle offset after 0.2 s by itself.
"""

from slipbench.controllers.slip_estimator import SLOWEST, SlipEstimator
from slipbench.identification.ecu.exported_law import ExportedLaw
from slipbench.identification.ecu.lua_laws import law
from slipbench.identification.ecu.rusefi import SCRIPT_SIZE, SLIP_SENSOR, SPEED_SENSOR
from slipbench.identification.ecu.rusefi_numbers import literal
from slipbench.protocol.errors import InputError

GIVEN_BACK = 0.1  # s of unknown slip
PERCENT = 100.0
DEGREES = 57.29578  # per rad
LEAST = SlipEstimator.lowest
NEVER_THROTTLE, NEVER_SPARK = "spark", "throttle"


def held_ticks(tick: float) -> int:
    """Ticks of unknown slip through which the offsets are held. tick: s."""
    return round(GIVEN_BACK / tick)


def script(exported: ExportedLaw) -> str:
    """The script. Raises InputError where it is larger than rusEFI takes."""
    own, steps = law(exported.tree, exported.tick)
    text = f"""-- slip control {exported.file.name}, made by slipbench: read README.md beside this file first
setTickRate({exported.tick_rate:g})
local target={literal(exported.target)}
local th,sp=0.0,0.0
{own}local on,unknown=false,0
local function slip()
 local ratio,speed=getSensor("{SLIP_SENSOR}"),getSensor("{SPEED_SENSOR}")
 if ratio==nil or speed==nil then return end
 local y,v=ratio-1.0,speed*{literal(1 / 3.6)}
 if v>{literal(SLOWEST)} and y>={literal(LEAST)} then return y,v end
end
local speed
function onTick()
 local y,v=slip()
 if y then unknown=0 speed=v if not on then on=true start(y,v) end
 else unknown=unknown+1
  if unknown>{held_ticks(exported.tick)} then on=false th=0.0 sp=0.0 end end
 if on then for i=1,{steps} do step(y,speed) end end
{_commands(exported.file.actuator)}end
"""
    if len(text) > SCRIPT_SIZE:
        raise InputError(
            "the script is larger than rusEFI takes",
            expected=f"at most {SCRIPT_SIZE} characters",
            found=f"{len(text)}",
            remedy="a controller of lower order: slipbench design ... --law pid",
        )
    return text


def _commands(actuator: str) -> str:
    throttle = "" if actuator == NEVER_THROTTLE else f" setEtbAdd(th*{literal(PERCENT)})\n"
    spark = "" if actuator == NEVER_SPARK else f" setTimingAdd(sp*{literal(DEGREES)})\n"
    return throttle + spark
