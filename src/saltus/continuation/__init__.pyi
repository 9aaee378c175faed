from .continuation_loop import Bounds, Continuation, Watch, both_ways
from .corrector import NEWTON, Corrected, Evaluation, newton
from .course import Course
from .curve import Curve, Point
from .end import CurveEnd, End, EndReason
from .events import Cut, Events
from .missed import CurveMissed, Missed, MissedReason
from .predictor import between
from .pseudo_arclength import EquationCurve
from .step_length import STEPS, StepSettings
from .test_functions import TestFunction, located
from .zero import Evidence, Zero

__all__ = [
    "NEWTON",
    "STEPS",
    "Bounds",
    "Continuation",
    "Corrected",
    "Course",
    "Curve",
    "CurveEnd",
    "CurveMissed",
    "Cut",
    "End",
    "EndReason",
    "EquationCurve",
    "Evaluation",
    "Events",
    "Evidence",
    "Missed",
    "MissedReason",
    "Point",
    "StepSettings",
    "TestFunction",
    "Watch",
    "Zero",
    "between",
    "both_ways",
    "located",
    "newton",
]
