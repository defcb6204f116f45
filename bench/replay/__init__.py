"""Replay of a recorded log on one bus or several, by absolute deadlines."""
