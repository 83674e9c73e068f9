from .relay import Relay as Relay
from .relay import RelayReport as RelayReport
from .sources import open_source as open_source
