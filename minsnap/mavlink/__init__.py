"""MAVLink: setpoints streamed to a vehicle, on time, and stopped when they should be."""
