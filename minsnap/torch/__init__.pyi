from .layers import cost as cost
from .layers import plan as plan
from .layers import positions as positions
