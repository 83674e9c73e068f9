from .comparison import Comparison as Comparison
from .comparison import compare as compare
from .flight_fit import FlightFit as FlightFit
from .flight_fit import fit_flight as fit_flight
from .simulated_flights import simulated_log as simulated_log
from .tracking_plot import plot_flight_fit as plot_flight_fit
from .tracking_plot import plot_tracking as plot_tracking
