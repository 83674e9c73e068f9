from . import missions as missions
from . import routes as routes
from . import shapes as shapes
from .shapes import circle as circle
from .shapes import line as line
from .shapes import rectangle as rectangle
from .surveys import SURVEY as SURVEY
from .surveys import Survey as Survey
