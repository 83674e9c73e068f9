from .explorer import Explorer as Explorer
from .explorer import SeenSoFar as SeenSoFar
from .grid_map import GridMap as GridMap
from .map_files import read_map as read_map
from .plan_route import Route as Route
from .plan_route import plan_through as plan_through
from .surroundings import corridor as corridor
