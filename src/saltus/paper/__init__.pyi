from .claims.claim import Agreement, Claim, tally
from .figures.figure import PaperFigure
from .parts import FIGURES
from .reproduction import Result, reproduce

__all__ = ["FIGURES", "Agreement", "Claim", "PaperFigure", "Result", "reproduce", "tally"]
