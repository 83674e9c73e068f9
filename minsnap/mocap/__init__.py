"""Motion capture: poses received, replayed and passed on to an autopilot."""
