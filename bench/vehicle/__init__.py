"""Virtual motorcycle on a CAN bus: devices, instruments, rider and road."""
