from .curves import circle as circle
from .curves import helix as helix
from .curves import lemniscate as lemniscate
from .straight import line as line
from .straight import rectangle as rectangle
