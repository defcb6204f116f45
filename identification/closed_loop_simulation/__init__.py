"""Closed-loop simulation of slip control on the motorcycle model, with sensors and delays."""
