from .opening import open_source as open_source
from .relay import Relay as Relay
from .relay import RelayReport as RelayReport
