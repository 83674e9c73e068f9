"""A flight in a thread of its own, so that a test can be the pilot and the weather."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from clocks import enter, leave

from minsnap.files.frames import map_vectors
from minsnap.flight.mavlink.link import open_link
from minsnap.flight.mavlink.offboard import prepare
from minsnap.flight.mavlink.stream_options import SafetyRules, StreamOptions
from minsnap.flight.mavlink.streaming import Streamer
from minsnap.trajectory.samples import Samples


def excursion(duration=10.0, rate=20.0, reach=4.0):
    """Out along x, up and back, at rest at both ends, turning: s(t) = sin^4 is smooth enough for four derivatives."""
    t = np.arange(round(duration * rate) + 1) / rate
    w = np.pi / duration
    s, c = np.sin(w * t), np.cos(w * t)
    shape = s**4
    first = 4 * w * s**3 * c
    second = 4 * w**2 * (3 * s**2 * c**2 - s**4)
    along = np.array([reach, 0.5, 0.25 * reach])
    position = np.outer(shape, along) + [0, 0, 1.5]
    return Samples(t, position, np.outer(first, along), np.outer(second, along), yaw=0.6 * shape, yaw_rate=0.6 * first)


def in_ned(position):
    return tuple(map_vectors(position, "enu", "ned"))


def patient_rules(**changes):
    """Rules that mind no gap."""
    return SafetyRules(**{"max_gap": 60.0} | changes)


def stall_once(flight, seconds, after=1.0):
    """Return a callback that keeps the streamer busy for so long [s], once, some time after the flight began."""

    def status(told):
        flight.statuses.append(told)
        if told.index is not None and told.elapsed > after and not flight.stalled:
            flight.stalled = True
            flight.clock.wait(flight.clock.now() + seconds, [])

    flight.stalled = False
    return status


PATH = excursion(8.0, reach=3.0)
START = in_ned(PATH.position[0])


class Flight:
    """A streamer that runs beside the test."""

    def __init__(self, standin, samples, clock, link=None, signing_key=None, **options):
        self.events, self.statuses = [], []
        options.setdefault("rules", patient_rules())
        self.options = StreamOptions(**options)
        self.link = link or open_link(f"udpout:127.0.0.1:{standin.port}", clock, signing_key=signing_key)
        table = prepare(samples, self.options)
        self.streamer = Streamer(table, self.link, self.options, clock, self.events.append, self.statuses.append)
        self.clock, self._pool = clock, ThreadPoolExecutor(1)
        enter(clock)
        self._future = self._pool.submit(self._run)

    def _run(self):
        try:
            return self.streamer.run()
        finally:
            leave(self.clock)

    def result(self):
        """Return the report, or raise what the streamer raised."""
        while not self._future.done():
            self.clock.wait(self.clock.now() + 0.01, [])
        return self._future.result()

    def stop(self):
        self.streamer.stop()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()
        self.stop()
        while not self._future.done():
            self.clock.wait(self.clock.now() + 0.01, [])
        self._pool.shutdown()
        self.link.close()
