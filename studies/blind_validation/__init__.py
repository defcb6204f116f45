"""Blind validation: hidden cases from an independent generator, analysed and scored."""
