from .claims.claim import Claim, ClaimVerdict, with_summaries
from .claims.ledger import HEADINGS, ledger, tally
from .figures.figure import PaperFigure
from .parts import FIGURES
from .reproduction import Result, reproduce

__all__ = [
    "FIGURES",
    "HEADINGS",
    "Claim",
    "ClaimVerdict",
    "PaperFigure",
    "Result",
    "ledger",
    "reproduce",
    "tally",
    "with_summaries",
]
