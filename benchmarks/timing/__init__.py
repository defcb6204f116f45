"""Periodic senders and players measured side by side, all by the same clocks."""
