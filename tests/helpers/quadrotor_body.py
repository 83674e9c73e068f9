"""The simulated quadrotor with its PX4-like controller, as the body of a stand-in autopilot."""

from minsnap.flight.simulation.controllers import CascadeController, Estimate, Reference
from minsnap.vehicle.dynamics import RigidBody
from minsnap.vehicle.quadrotor import Quadrotor

STEP = 0.004
STILL = (0.0, 0.0, 0.0)


def world(vector):
    """North-east-down to east-north-up, which is its own inverse."""
    north, east, down = vector
    return (east, north, -down)


class QuadrotorBody:
    """Position and velocity in NED for the autopilot; dynamics and controller in the world, 250 times per second."""

    def __init__(self, position=(0.0, 0.0, 0.0)):
        vehicle = Quadrotor.dji_f330()
        self._body, self._pilot = RigidBody(vehicle), CascadeController().pilot(vehicle, STEP)
        self._speeds = [vehicle.hover_rotor_speed] * 4
        self._state = [*world(position), 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        self._hover = self._reference(world(position))
        self._owed = 0.0

    @property
    def position(self):
        return list(world(self._state[0:3]))

    @property
    def velocity(self):
        return list(world(self._state[3:6]))

    @staticmethod
    def _reference(position, velocity=STILL, acceleration=STILL, yaw=0.0, yaw_rate=0.0):
        return Reference(position, velocity, acceleration, STILL, yaw, yaw_rate, STILL, STILL)

    def follow(self, setpoint, dt):
        vectors = (
            world((setpoint.x, setpoint.y, setpoint.z)),
            world((setpoint.vx, setpoint.vy, setpoint.vz)),
            world((setpoint.afx, setpoint.afy, setpoint.afz)),
        )
        self._fly(self._reference(*vectors, 1.5707963267948966 - setpoint.yaw, -setpoint.yaw_rate), dt)
        self._hover = self._reference(tuple(self._state[0:3]))

    def rest(self, dt):
        self._fly(self._hover, dt)

    def descend(self, dt, floor=0.0):
        x, y, z = self._hover.position
        self._hover = self._reference((x, y, max(0.0, z - 0.8 * dt)))
        self._fly(self._hover, dt)

    def _fly(self, reference, dt):
        self._owed += dt
        while self._owed >= STEP:
            self._owed -= STEP
            s = self._state
            estimate = Estimate(tuple(s[0:3]), tuple(s[3:6]), tuple(s[6:10]), tuple(s[10:13]))
            told = self._pilot.command(estimate, reference).rotor_speed
            self._state = self._body.advance(s, (told, told, told), STILL, STEP)
            if self._state[2] < 0.0:
                self._state[2], self._state[5] = 0.0, max(0.0, self._state[5])
