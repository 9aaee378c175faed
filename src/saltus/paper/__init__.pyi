from .claims.claim import Claim, Verdict, tally
from .figures.figure import PaperFigure
from .parts import FIGURES
from .reproduction import Result, reproduce

__all__ = ["FIGURES", "Claim", "PaperFigure", "Result", "Verdict", "reproduce", "tally"]
