"""Real recordings in which something is concealed, explained one by one."""
