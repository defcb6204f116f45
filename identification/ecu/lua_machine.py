"""An interpreter that runs a rusEFI script on this computer, with rusEFI's numbers.

Lua 5.4 with nothing but `math` and the functions of rusEFI that the scripts use. rusEFI's numbers are
single precision: the sensors give numbers of a type of their own, each operation on which is rounded
to single precision, and so is all that follows from them. It does not imitate: the time a tick takes
on a microcontroller, its memory, and other functions of rusEFI.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slipbench.identification.ecu.rusefi import SLIP_SENSOR, SPEED_SENSOR
from slipbench.identification.ecu.rusefi_numbers import as_read
from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library
from slipbench.protocol.recording.channel import FloatArray

HOST = f"""
local pack,unpack,type,setmetatable=string.pack,string.unpack,type,setmetatable
local function number(x) if type(x)=="table" then return x[1] end return unpack("f",pack("f",x)) end
local single={{}}
local function made(x) return setmetatable({{unpack("f",pack("f",x))}},single) end
single.__add=function(a,b) return made(number(a)+number(b)) end
single.__sub=function(a,b) return made(number(a)-number(b)) end
single.__mul=function(a,b) return made(number(a)*number(b)) end
single.__div=function(a,b) return made(number(a)/number(b)) end
single.__unm=function(a) return made(-number(a)) end
single.__lt=function(a,b) return number(a)<number(b) end
single.__le=function(a,b) return number(a)<=number(b) end
local sensors,etb,timing,rate={{}},0.0,0.0,0.0
local all=_G
for name in pairs(all) do if name~="math" then all[name]=nil end end
function getSensor(name) return sensors[name] end
function setEtbAdd(x) etb=number(x) end
function setTimingAdd(x) timing=number(x) end
function setTickRate(x) rate=number(x) end
local function given(x) if x~=x then return nil end return made(x) end
return function() return rate end, function(ratio,speed)
 sensors.{SLIP_SENSOR}=given(ratio) sensors.{SPEED_SENSOR}=given(speed)
 onTick()
 return etb,timing
end
"""


@dataclass(frozen=True, eq=False)
class EcuCommands:
    """throttle: offset, share of the opening; spark: offset, rad. Shape (n,), one value a tick."""

    throttle: FloatArray
    spark: FloatArray


class LuaMachine:
    """A script that is loaded, and its state."""

    def __init__(self, script: str) -> None:
        """Load a script. Raises InputError where lupa is missing or the script has a fault."""
        lupa = optional_library("lupa.lua54")
        self._fault = lupa.LuaError
        lua = lupa.LuaRuntime(register_eval=False, register_builtins=False)
        self._rate, self._tick = lua.execute(HOST)
        self._run(lua.execute, as_read(script))

    @property
    def tick_rate(self) -> float:
        """Ticks per second for which the script asked, Hz."""
        return float(self._rate())

    def ticks(self, ratio: Sequence[float], speed: Sequence[float]) -> EcuCommands:
        """Commands after each tick. ratio: driven over reference speed; speed: km/h; NaN: not valid."""
        rows = [
            self._run(self._tick, float(r), float(v)) for r, v in zip(ratio, speed, strict=True)
        ]
        etb, timing = np.array(rows, dtype=float).reshape(-1, 2).T
        return EcuCommands(etb / 100.0, np.radians(timing))

    def _run(self, function: object, *arguments: object) -> tuple[float, float]:
        assert callable(function)
        try:
            done: tuple[float, float] = function(*arguments)
        except self._fault as fault:
            raise InputError("the Lua script has a fault", found=str(fault)) from fault
        return done
