from .planner import plan as plan
from .request import PLAIN as PLAIN
from .request import RESERVE as RESERVE
from .request import Box as Box
from .request import Opening as Opening
from .request import PlanRequest as PlanRequest
from .request import Point as Point
from .request import plan_arguments as plan_arguments
