"""Control laws and their design."""
