"""Several vehicles, each over a link of its own, flown on one clock."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

from minsnap.errors import FlightError, InputError
from minsnap.flight.mavlink.common_flight import CommonFlight
from minsnap.flight.mavlink.link import Link
from minsnap.flight.mavlink.observer import StatusCallback
from minsnap.flight.mavlink.schedule import Clock
from minsnap.flight.mavlink.setpoints import SetpointTable
from minsnap.flight.mavlink.stream_options import StreamOptions, StreamReport
from minsnap.flight.mavlink.streaming import Streamer
from minsnap.flight.mavlink.undisturbed import undisturbed


def stream_together(
    tables: Sequence[SetpointTable],
    links: Sequence[Link],
    options: Sequence[StreamOptions],
    names: Sequence[str],
    clock: Clock,
    on_event: Callable[[str], None] | None = None,
    on_status: StatusCallback | None = None,
    begun: Callable[[Callable[[], None]], None] = lambda stop: None,
) -> list[StreamReport | FlightError]:
    """Fly several vehicles, each over its own link, from one instant on; what stops one stops all where they are.

    Parameters
    ----------
    tables, links, options, names : sequence
        One each a vehicle; options with a callable trigger, the first of which lets all go.
    clock : Clock
        The same as the links'.
    on_event : callable, optional
        Told sentences, each begun by the vehicle's name, from several threads.
    on_status : callable, optional
        Called with the status of the first vehicle.
    begun : callable, optional
        Called with what stops all, before they fly.

    Returns
    -------
    list
        What each flight reports, or the error that ended it.

    Raises
    ------
    InputError
        If the rates differ.
    """
    rates = {table.rate for table in tables}
    if len(rates) > 1:
        raise InputError(f"the setpoints of a fleet have one rate, and these have {sorted(rates)}: give --rate")
    trigger = options[0].trigger
    common = CommonFlight(names, clock, rates.pop(), trigger if callable(trigger) else lambda: True)

    def said(name: str) -> Callable[[str], None] | None:
        return None if on_event is None else lambda text: on_event(f"{name}: {text}")

    flights = [
        Streamer(table, link, option, clock, said(name), None if k else on_status, common=(common, k))
        for k, (table, link, option, name) in enumerate(zip(tables, links, options, names, strict=True))
    ]

    def stop() -> None:
        for flight in flights:
            flight.stop()

    begun(stop)

    def fly(flight: Streamer, member: int) -> StreamReport | FlightError:
        try:
            return flight.run()
        except FlightError as error:
            common.tell(member, False, str(error))
            return error
        except BaseException as error:
            common.tell(member, False, str(error))
            raise

    with undisturbed(type(clock) is Clock) as granted, ThreadPoolExecutor(len(flights)) as pool:
        if granted and on_event is not None:
            on_event(granted)
        return [future.result() for future in [pool.submit(fly, flight, k) for k, flight in enumerate(flights)]]
