"""Flying: frames, simulation, and the way from a file of setpoints to a vehicle in the air."""
