"""An FMU with its calibrated parameters and effects, as an FMU that other tools simulate."""
