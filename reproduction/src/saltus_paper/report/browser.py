"""The report as PDF: printed by a browser of the Chromium family, if there is one."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from saltus import save

BROWSERS = (
    *(
        "chromium",
        "chromium-browser",
        "google-chrome",
        "google-chrome-stable",
        "microsoft-edge",
        "msedge",
        "chrome",
    ),
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
)
LONGEST = 120.0  # s; a report of all parts takes about five seconds


def browser() -> str | None:
    """The path of a browser that prints without a window, or None."""
    return next(filter(None, map(shutil.which, BROWSERS)), None)


def print_pdf(page: Path, pdf: Path, mark: Path) -> str | None:
    """Print an HTML file of our own, unless `mark` says that exactly these bytes were printed;
    returns why it failed, or None.

    A PDF of an earlier report is removed, so that it is not taken for the present one.
    """
    content = page.read_bytes()
    if pdf.exists() and mark.exists() and mark.read_text(encoding="utf-8") == _mark(content, pdf):
        return None
    pdf.unlink(missing_ok=True)
    found = browser()
    if found is None:
        return (
            f"no Chromium, Chrome or Edge was found, so there is no {pdf.name}: print "
            f"{page.name} from any browser"
        )
    with tempfile.TemporaryDirectory(prefix="saltus-print-", ignore_cleanup_errors=True) as folder:
        made = Path(folder) / "report.pdf"
        options = [
            f"--user-data-dir={folder}/profile",
            f"--print-to-pdf={made}",
            "--no-pdf-header-footer",
            "--disable-gpu",
        ]
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            # else the browser refuses to run as root; the page is ours and loads nothing
            options.append("--no-sandbox")
        try:
            subprocess.run(
                [found, "--headless", *options, page.resolve().as_uri()],
                capture_output=True,
                timeout=LONGEST,
                check=True,
            )
            printed = made.read_bytes()
        except (OSError, subprocess.SubprocessError) as error:
            return (
                f"{found} could not print {page.name} ({type(error).__name__}), so there is "
                f"no {pdf.name}"
            )
    save(pdf, printed)
    save(mark, _mark(content, pdf))
    return None


def _mark(content: bytes, pdf: Path) -> str:
    return f"{hashlib.sha256(content).hexdigest()} {hashlib.sha256(pdf.read_bytes()).hexdigest()}"
