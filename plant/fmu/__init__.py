"""The motorcycle as an FMU for co-simulation: its compiled kernel behind the interface of FMI."""
