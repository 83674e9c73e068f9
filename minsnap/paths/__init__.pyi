from . import missions as missions
from . import routes as routes
from . import shapes as shapes
