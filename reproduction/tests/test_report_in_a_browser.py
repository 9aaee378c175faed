"""The report in a real browser: its scripts, its filter, the large picture, narrow screens and
paper.
"""

import base64
import shutil

import pytest
from browser_page import BrowserPage

from saltus_paper import report_as_pdf
from saltus_paper.report import browser

SHOWN = "[...document.querySelectorAll('.claim')].filter((one) => one.offsetParent !== null)"


@pytest.fixture(scope="module")
def window(tmp_path_factory):
    found = browser.browser()
    if found is None:
        pytest.skip("no Chromium, Chrome or Edge is installed here")
    page = BrowserPage(found, tmp_path_factory.mktemp("profile"))
    yield page
    page.close()


@pytest.fixture
def page(window, results):
    window.errors.clear()
    window.open(results / "report.html", 1280)
    yield window
    assert window.errors == []  # of its scripts, or something that it could not load


@pytest.mark.parametrize("width", [380, 1280])
def test_nothing_is_wider_than_the_screen(page, results, width):
    page.open(results / "report.html", width)
    page.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate(
        "[...document.images].filter((one) => one.hasAttribute('src')).every((one) => "
        "one.naturalWidth > 100)"
    )


def test_the_filter_hides_the_claims_of_a_verdict_counts_and_shows_what_a_link_leads_to(page):
    everything = page.evaluate(f"{SHOWN}.length")
    corrected = page.evaluate("document.querySelectorAll('.claim.corrected').length")
    assert 0 < corrected < everything
    page.click("#show-corrected")
    assert page.evaluate(f"{SHOWN}.length") == everything - corrected
    assert (
        page.evaluate("document.getElementById('shown').textContent")
        == f"{everything - corrected} of {everything} shown"
    )
    page.evaluate("location.hash = '#fig08-domain'")
    assert page.evaluate("document.getElementById('fig08-domain').offsetParent !== null")
    page.evaluate("location.hash = ''")
    page.click("#show-corrected")
    assert page.evaluate(f"{SHOWN}.length") == everything


def test_the_large_picture_opens_and_closes_by_pointer_and_by_keys(page):
    large = "document.getElementById('large').open"
    link = "article .enlarge"
    page.click(link)
    assert page.evaluate(large)
    width = page.evaluate(
        "document.querySelector('#large img').decode().then(() => document.querySelector('#large "
        "img').width)"
    )
    assert width == page.evaluate(f"document.querySelector('{link} img').naturalWidth") > 1280
    page.press("Escape", 27)
    assert not page.evaluate(large)
    assert page.evaluate(f"document.activeElement === document.querySelector('{link}')")
    page.press("Enter", 13)
    assert page.evaluate(large)
    page.click("#large button")
    assert not page.evaluate(large)


def test_every_claim_can_be_reached_by_its_link(page):
    lost = (
        "[...document.querySelectorAll('a[href^=\"#\"]')].filter((a) => "
        "!document.getElementById(a.hash.slice(1))).length"
    )
    assert page.evaluate(lost) == 0


def test_paper_shows_what_is_folded_and_leaves_out_what_is_to_click(page):
    page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    assert page.evaluate("[...document.querySelectorAll('details')].every((one) => one.open)")
    page.evaluate("window.dispatchEvent(new Event('afterprint'))")
    assert not page.evaluate("[...document.querySelectorAll('details')].some((one) => one.open)")
    page("Emulation.setEmulatedMedia", media="print")
    assert page.evaluate("getComputedStyle(document.querySelector('.bar')).display") == "none"
    page("Emulation.setEmulatedMedia", media="")
    printed = base64.b64decode(page("Page.printToPDF", preferCSSPageSize=True)["data"])
    assert printed.startswith(b"%PDF")


def test_the_pdf_is_printed_once_and_removed_when_it_is_of_another_report(
    results, tmp_path, monkeypatch
):
    if browser.browser() is None:
        pytest.skip("no Chromium, Chrome or Edge is installed here")
    folder = shutil.copytree(results, tmp_path / "results")
    assert report_as_pdf(folder) is None
    pdf = folder / "report.pdf"
    assert pdf.read_bytes().startswith(b"%PDF")
    before = pdf.stat().st_mtime_ns
    assert report_as_pdf(folder) is None
    assert pdf.stat().st_mtime_ns == before
    monkeypatch.setattr(browser, "BROWSERS", ())
    (folder / "report.html").write_text("another")
    assert "no Chromium, Chrome or Edge was found" in report_as_pdf(folder)
    assert not pdf.exists()


def test_a_browser_that_cannot_print_is_told(results, tmp_path, monkeypatch):
    folder = shutil.copytree(results, tmp_path / "results")
    monkeypatch.setattr(browser, "browser", lambda: shutil.which("false"))
    said = report_as_pdf(folder)
    assert "could not print report.html" in said
    assert not (folder / "report.pdf").exists()
