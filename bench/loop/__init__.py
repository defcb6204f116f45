"""The periodic loop and what runs beside it: clock, ticks, ring, recorder, real-time process."""
