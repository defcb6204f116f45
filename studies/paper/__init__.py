"""Reproduction of Corno and Savaresi (SYSID 2009), claim by claim."""
