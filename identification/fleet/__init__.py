"""Analyses of many vehicles or a whole season in one command."""
