from .memory import Change as Change
from .replanner import Replanner as Replanner
from .replanner import replan as replan
