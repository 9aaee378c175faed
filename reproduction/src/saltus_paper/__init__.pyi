from .claims.claim import Claim, ClaimVerdict, with_summaries
from .claims.ledger import HEADINGS, ledger, tally
from .figures.figure import PaperFigure
from .parts import FIGURES
from .report.report import report_as_pdf, report_from_results
from .reproduction import MadeFigure, reproduce

__all__ = [
    "FIGURES",
    "HEADINGS",
    "Claim",
    "ClaimVerdict",
    "MadeFigure",
    "PaperFigure",
    "ledger",
    "report_as_pdf",
    "report_from_results",
    "reproduce",
    "tally",
    "with_summaries",
]
