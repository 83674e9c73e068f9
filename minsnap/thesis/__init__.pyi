from .experiment import Experiment as Experiment
from .experiment import run_experiment as run_experiment
from .experiment_course import Course as Course
from .experiment_course import course as course
from .experiment_plot import plot_experiment as plot_experiment
