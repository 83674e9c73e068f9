"""Flights whose plan changes in the air, without a vehicle."""

from minsnap.flight.mavlink.setpoints import ChangingTable, tabulate


class Flown:
    """A flight whose time a test sets, with the table of a real one, which refuses changes that do not join."""

    def __init__(self, plan):
        self.table, self.elapsed, self.stops = ChangingTable(tabulate(plan.sample(20.0)), stays=True), None, 0

    @property
    def now(self):
        return None if self.elapsed is None else self.elapsed - self.began

    @property
    def began(self):
        return self.table.began

    def change(self, change):
        chosen = change.trajectory if change.certified else change.stop
        self.table.exchange(self.table.prepare(chosen, change.splice), self.elapsed)
        return chosen

    def stop(self):
        self.stops += 1

    def finish(self):
        self.table.stays = False
