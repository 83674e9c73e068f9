from .curves import circle as circle
from .curves import helix as helix
from .curves import lemniscate as lemniscate
from .phase import PhaseLaw as PhaseLaw
from .phase import PhasePath as PhasePath
from .polynomial_form import as_polynomials as as_polynomials
from .straight import line as line
from .straight import rectangle as rectangle
