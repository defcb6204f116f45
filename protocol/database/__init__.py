"""CAN databases: read from DBC, checked, described as frozen data."""
