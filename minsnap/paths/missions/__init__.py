"""Missions: courses of waypoints and gates from files, flown with take-off, run-up, laps, holds and landing."""
