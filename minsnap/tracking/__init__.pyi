from .comparison import Comparison as Comparison
from .comparison import compare as compare
from .tracking_plot import plot_tracking as plot_tracking
