"""What a test does as the pilot, and what it sees of the setpoints that come."""

import numpy as np


def sent(vehicle):
    return [message for _, message in vehicle.setpoints]


def places(vehicle):
    return np.array([(m.x, m.y, m.z) for m in sent(vehicle)])


def stands_still(messages):
    return all((m.vx, m.vy, m.vz, m.afx, m.afy, m.afz, m.yaw_rate) == (0,) * 7 for m in messages)


def streamed(vehicle, seconds):
    return len(vehicle.setpoints) > 20 * seconds


def fly_until(flight, vehicle, beyond=1.5):
    vehicle.until(lambda v: "ready" in flight.events)
    vehicle.enter()
    vehicle.until(lambda v: any(status.elapsed > beyond for status in flight.statuses[-500:]))


MESSAGE_INTERVAL = 511


def commanded(vehicle):
    """The commands that came, but for requests of messages."""
    return [command for command in vehicle.commands if command[0] != MESSAGE_INTERVAL]
