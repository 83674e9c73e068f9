"""Files: setpoints, other programs' formats, logs."""
