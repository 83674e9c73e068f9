"""A stand-in autopilot on a fast clock, hovering at the start of a path."""

import pytest
from clocks import FastClock
from flying import START
from standin import PointMass, StandIn

SPEED = 6


@pytest.fixture
def clock():
    return FastClock(SPEED)


@pytest.fixture
def vehicle(clock):
    with StandIn(clock=clock.now, body=PointMass(START)) as standin:
        yield standin
