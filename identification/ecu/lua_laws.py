"""The control laws as Lua: the same steps as in `controllers`, written for one controller.

Every law is a function `step(y, v)`: y the slip, nil while it is unknown; v the speed, m/s. It moves
the throttle offset `th` (share of the opening) and the spark offset `sp` (rad). A section of a filter
is a table {b0, b1 - a1 b0, b2 - a2 b0, a1, a2, rest, gain, x1, x2}: rest is x1 under a constant input
1, gain the output then.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from slipbench.controllers.linear import in_series
from slipbench.identification.ecu.rusefi_numbers import literal

SECTIONS = """\
local function out(F,u) for i=1,#F do local s=F[i] u=s[1]*u+s[2]*s[8]+s[3]*s[9] end return u end
local function go(F,u) for i=1,#F do local s=F[i]
 local o=s[1]*u+s[2]*s[8]+s[3]*s[9]
 s[8],s[9]=u-s[4]*s[8]-s[5]*s[9],s[8] u=o end end
local function rest(F,u) for i=1,#F do local s=F[i] s[8]=s[6]*u s[9]=s[8] u=s[7]*u end end
local function clear(F) rest(F,0.0) end
"""
LIMITS = """\
local function to(w,last,low,reach)
 if w<low then w=low end if w>0.0 then w=0.0 end
 if w>last+reach then w=last+reach end if w<last-reach then w=last-reach end
 return w end
local function vain(push,last,low) return (push>0.0 and last>=0.0) or (push<0.0 and last<=low) end
"""
LINE = """\
local function line(n) local L={i=1} for i=1,n do L[i]=0.0 end return L end
local function late(L,x) L.i=L.i%#L+1 L[L.i]=x return L[L.i%#L+1] end
"""


def law(tree: Mapping[str, Any], tick: float) -> tuple[str, int]:
    """Lua of the law of a controller, and its steps in a tick. tree: numbers; tick: s."""
    name = "sp" if tree["actuator"] == "spark" else "th"
    periods = round(tick / tree["period"])
    if tree.get("mixed"):
        return _mixed(tree), periods
    if tree["law"]["kind"] == "pid":
        return _pid(tree, name, tick), 1
    if tree["law"]["kind"] == "linear":
        return _linear(tree, name), periods
    return _internal_model(tree, name), periods


def _sections(rows: Sequence[Sequence[float]]) -> str:
    return "{" + ",\n ".join(_section(*row) for row in rows) + "}"


def _section(b0: float, b1: float, b2: float, a1: float, a2: float) -> str:
    rest = 1.0 / (1.0 + a1 + a2)
    numbers = (b0, b1 - a1 * b0, b2 - a2 * b0, a1, a2, rest, (b0 + b1 + b2) * rest)
    return "{" + ",".join(map(literal, numbers)) + ",0.0,0.0}"


def _bounds(limits: Mapping[str, float], dt: float) -> str:
    """Arguments of `to` behind the last command: lower limit and largest change in a step."""
    return f"{literal(limits['low'])},{literal(limits['rate'] * dt)}"


def _internal_model(tree: Mapping[str, Any], name: str) -> str:
    own, limits = tree["law"], tree["limits"]
    return f"""{SECTIONS}{LIMITS}{LINE}local G={_sections(own["model"])}
local Q={_sections(own["inverse"])}
local L,level
local function start(y) level=y L=line({own["delay"] + 1}) clear(G) clear(Q) end
local function step(y)
 if y then
  local e=target-level-(y-level-out(G,0.0))
  {name}=to(out(Q,e),{name},{_bounds(limits, tree["period"])})
  local push={literal(in_series(own["inverse"]).gain)}*e-{name}
  if vain(push,{name},{literal(limits["low"])}) then rest(Q,e) else go(Q,e) end
 end
 go(G,late(L,{name}))
end
"""


def _linear(tree: Mapping[str, Any], name: str) -> str:
    own, dt = tree["law"], tree["period"]
    return f"""{SECTIONS}{LIMITS}local F={_sections(own["shaping"])}
local I
local function start() I=0.0 clear(F) end
local function step(y)
 if not y then return end
 local e=target-y
 local w=I+out(F,e)
 {name}=to(w,{name},{_bounds(tree["limits"], dt)})
 I=I+{literal(own["integral"] * dt)}*e+{literal(min(dt / own["tracking_time"], 1.0))}*({name}-w)
 go(F,e)
end
"""


def _pid(tree: Mapping[str, Any], name: str, tick: float) -> str:
    rows = tree["schedule"] or [{"speed": 0.0, "gains": tree["law"]}]
    first = rows[0]["gains"]
    b, filtered, tracked = first["reference_weight"], first["filter_time"], first["tracking_time"]
    return f"""{LIMITS}{_gains(rows)}local I,D,last
local function start(y,v)
 local P=gains(v)
 I=P*{literal(1.0 - b)}*y D=0.0 last=y
end
local function step(y,v)
 if not y then D=0.0 return end
 local P,K,d=gains(v)
 D=({literal(filtered)}*D-d*(y-last))*{literal(1.0 / (filtered + tick))}
 local w=P*({literal(b)}*target-y)+I+D
 {name}=to(w,{name},{_bounds(tree["limits"], tick)})
 I=I+K*(target-y)*{literal(tick)}+{literal(min(tick / tracked, 1.0))}*({name}-w)
 last=y
end
"""


def _gains(rows: Sequence[Mapping[str, Any]]) -> str:
    """`gains(v)`: proportional, integral and derivative gain at a speed, between two rows linear."""
    made = ",\n ".join(_gain_row(row["speed"], row["gains"]) for row in rows)
    return f"""local S={{{made}}}
local function gains(v)
 local a=S[1]
 for i=2,#S do
  local b=S[i]
  if v<=a[1] then break end
  if v<b[1] then
   local x=(v-a[1])/(b[1]-a[1])
   return a[2]+x*(b[2]-a[2]),a[3]+x*(b[3]-a[3]),a[4]+x*(b[4]-a[4])
  end
  a=b
 end
 return a[2],a[3],a[4]
end
"""


def _gain_row(speed: float, own: Mapping[str, float]) -> str:
    numbers = (speed, own["proportional"], own["integral"], own["derivative"])
    return "{" + ",".join(map(literal, numbers)) + "}"


def _mixed(tree: Mapping[str, Any]) -> str:
    fast, limits, own, dt = tree["law"], tree["limits"], tree["mixed"], tree["period"]
    slow = own["law"]
    return f"""{SECTIONS}{LIMITS}{LINE}local function inverse() return {_sections(slow["inverse"])} end
local A,B=inverse(),inverse()
local Q={_sections(fast["inverse"])}
local G={_sections(slow["model"])}
local H={_sections(fast["model"])}
local M={_sections(own["later"])}
local T,S,R,level,r
local function start(y)
 level=y r=0.0 T=line({slow["delay"] + 1}) S=line({fast["delay"] + 1}) R=line({own["delay"] + 1})
 clear(A) clear(B) clear(Q) clear(G) clear(H) clear(M)
end
local function step(y)
 local done
 if y then
  local w=target-level
  local d=y-level-out(G,0.0)-out(H,0.0)
  local asked=out(A,w)
  th=to(asked+out(B,-d),th,{_bounds(own["throttle"], dt)})
  r=(th-asked)*{literal(1.0 / own["exchange"])}
  done=late(R,r)
  local x=out(Q,-d)-out(M,done)
  if x>{literal(own["zone"])} then x=x-{literal(own["zone"])}
  elseif x<{literal(-own["zone"])} then x=x+{literal(own["zone"])} else x=0.0 end
  sp=to(x,sp,{_bounds(limits, dt)})
  local push={literal(in_series(slow["inverse"]).gain)}*(w-d)-th
  if vain(push,th,{literal(own["throttle"]["low"])}) then rest(A,w) rest(B,-d) else go(A,w) go(B,-d) end
  go(Q,-d)
 else done=late(R,r) end
 go(G,late(T,th)) go(H,late(S,sp)) go(M,done)
end
"""
