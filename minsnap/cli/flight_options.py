"""Options of a flight over MAVLink, of ``stream`` and ``tune``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

if TYPE_CHECKING:
    from minsnap.flight.mavlink.stream_options import StreamOptions


@dataclass(frozen=True)
class FlightOptions:
    """How a flight begins, ends and stops."""

    trigger: Annotated[str, "enter, mode (when the vehicle enters OFFBOARD or GUIDED) or now."] = "enter"
    abort_distance: Annotated[
        float | None, "M", "Distance of the vehicle from the plan at which the flight stops; by default fits its lag."
    ] = None
    arm: Annotated[bool, "Change the mode and arm. Never done without this."] = False
    land: Annotated[bool, "Land at the end instead of holding."] = False
    preflight: Annotated[
        bool, "--preflight/--no-preflight", "Check parameters and state first; refuse what must end."
    ] = True

    def settings(self, max_start_distance: float = 1.0, **others: Any) -> StreamOptions:
        """Return the options of the stream, with others of it.

        Raises
        ------
        InputError
            If the trigger is unknown.
        """
        from minsnap.cli.flying import trigger_of
        from minsnap.flight.mavlink.stream_options import SafetyRules, StreamOptions

        rules = SafetyRules(max_start_distance, self.abort_distance)
        return StreamOptions(trigger=trigger_of(self.trigger), rules=rules, arm=self.arm, land=self.land, **others)
