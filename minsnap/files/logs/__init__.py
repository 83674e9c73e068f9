"""Flight logs of PX4 and ArduPilot."""
