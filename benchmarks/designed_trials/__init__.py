"""Blind comparison of designed trials with a fixed plan and with a menu."""
