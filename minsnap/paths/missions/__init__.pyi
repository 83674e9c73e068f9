from .course import Course as Course
from .course import Stop as Stop
from .course import read_course as read_course
from .mission import Mission as Mission
from .mission import plan_mission as plan_mission
