"""Corno and Savaresi's findings, claim by claim."""
