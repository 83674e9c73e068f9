from .bernstein import basis as basis
from .bernstein import elevate as elevate
