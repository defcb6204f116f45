"""Real-time ECU and traction-control bench over CAN: excite, record, identify, explain."""
