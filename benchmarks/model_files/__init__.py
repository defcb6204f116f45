"""Blind validation on model files: other systems than a motorcycle, with hidden effects."""
