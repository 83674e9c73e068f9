"""The studio: a page in the browser where plans are drawn, dragged and flown. Needs ``minsnap[studio]``."""

from minsnap.studio.fleet_studio import FleetStudio
from minsnap.studio.route_studio import RouteStudio
from minsnap.studio.studio import Studio, show

__all__ = ["FleetStudio", "RouteStudio", "Studio", "show"]
