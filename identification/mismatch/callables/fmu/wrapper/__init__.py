"""An FMU with its calibrated parameters and effects, exported as an FMU for other tools."""
