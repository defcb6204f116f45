"""Replay of a CAN log on one or more buses, with absolute deadlines."""
