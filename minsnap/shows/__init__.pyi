from .fleet_files import read_fleet as read_fleet
from .fleet_files import write_fleet as write_fleet
