"""Files: setpoints, formats of other programs, flight logs."""
