"""External simulations: a Python function or an FMU, with effects at its inputs and outputs."""
