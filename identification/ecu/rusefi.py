"""Limits of rusEFI's firmware, from its source code.

github.com/rusefi/rusefi: controllers/lua (lua.cpp, lua_hooks.cpp, luaconf.h), controllers/actuators/
electronic_throttle.cpp, controllers/algo/traction_control.cpp, integration/rusefi_config.txt; and
github.com/rusefi/rusefi/wiki/Lua-Scripting.
"""

FASTEST = 200.0  # Hz: setTickRate takes 1 to 200
SCRIPT_SIZE = 8000  # characters (LUA_SCRIPT_SIZE); boards with other sizes exist
SLIP_SENSOR = "WheelSlipRatio"  # driven over reference wheel speed; 1 without slip
SPEED_SENSOR = "VehicleSpeed"  # km/h
TABLE_SIZE = 6  # rows and columns of the traction control tables
SLIP_STEP = 0.01  # of tractionControlSlipBins
FASTEST_BIN = 255  # km/h, of tractionControlSpeedBins
LARGEST_DROP = 100  # % of throttle
LARGEST_RETARD = 90  # deg of spark advance
SINGLE_DIGITS = 1 << 24  # whole numbers below it are exact in single precision
