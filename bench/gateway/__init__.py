"""One tick on the bus: frames in, checks of senders and of our own frames, commands out."""
