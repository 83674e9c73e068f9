"""A stand-in autopilot on a clock of its own, hovering at the start of a path."""

import pytest
from clocks import SharedClock
from flying import START
from standin import PointMass, StandIn


@pytest.fixture
def clock():
    return SharedClock()


@pytest.fixture
def vehicle(clock):
    with StandIn(clock=clock, body=PointMass(START)) as standin:
        yield standin
