from .planner import plan as plan
from .request import PlanRequest as PlanRequest
from .request import plan_arguments as plan_arguments
