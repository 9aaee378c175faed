"""What is checked before anything counts as done: all that a user runs, from a fresh checkout.

`.ci/run` and `make ci` start it, with any Python from 3.11; it installs what it needs. STEPS is the
table of what it does, in order. It keeps a clock: after BEGIN_BEFORE minutes nothing more is begun,
and after END minutes what still runs is cut. A step that fails fails the whole; one that the clock
cuts, or that was not begun, is named at the end and does not. `--only test docs` runs some steps by
name, `--list` shows them all.
"""

from __future__ import annotations

import argparse
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
BEGIN_BEFORE, END = 55.0, 70.0  # minutes since the start
IMPOSSIBLE = 77  # the exit status of a step that this machine cannot run
SHARES = 16  # of the thorough tests; a commit runs one, the next commit the next
PASSED = r"(\d+) passed"  # as pytest says it
NUMERICAL = " ".join(
    f"tests/{folder}"
    for folder in (
        *("taylor", "flow", "orbits", "attractors", "sweep", "studies"),
        *("continuation", "bounds", "systems", "theory"),
    )
)
BROWSER_TESTS = " ".join(
    (
        *("tests/web/test_page_in_a_browser.py", "tests/web/test_page_end_to_end.py"),
        *("tests/web/test_results_in_a_browser.py", "tests/web/test_living_pages.py"),
        *("tests/web/test_page_in_all_browsers.py", "tests/web/test_explorer.py"),
        "reproduction/tests/test_report_in_a_browser.py",
    )
)
PYTEST = ".venv/bin/python -m pytest --assert=plain"
# What has failed, once more and alone: it tells what fails always from what failed once.
EXPLAINED = ".venv/bin/python -m pytest -n 0 --last-failed --last-failed-no-failures none"


@dataclass(frozen=True)
class Step:
    """One row of the table: shell commands, of which the first that fails ends the step.

    They end with the status IMPOSSIBLE where the machine lacks what they need.
    """

    name: str
    what: str
    commands: str
    minutes: float  # the step is cut after them
    counted: str = PASSED  # in each line of the output; the numbers are added up
    may_be_cut: bool = False  # at its own limit; at the end of the clock any step may
    may_fail: bool = False  # what is installed from elsewhere may be missing


# It ends with IMPOSSIBLE where something cannot be had.
INSTALL_SYSTEM = """
if test "$(id -u)" = 0 && command -v apt-get >/dev/null; then
    apt-get update -qq
    for wanted in chromium:chromium node:nodejs npm:npm; do
        command -v "${wanted%:*}" >/dev/null ||
            apt-get install -qq --no-install-recommends "${wanted#*:}" >/dev/null ||
            echo "${wanted#*:} cannot be installed here"
    done
fi
for command in chromium node npm; do
    command -v "$command" || missing="${missing:-} $command"
done
test -z "${missing:-}" || { echo "this machine lacks$missing"; exit 77; }
"""
INSTALL_PEERS = """
if test "$(id -u)" = 0 && command -v apt-get >/dev/null; then
    apt-get install -qq --no-install-recommends python3-siconos gcc >/dev/null || echo "no Siconos here"
fi
test -d .venv-peers || .venv/bin/python -m venv .venv-peers --without-pip
# What .venv has is there too, without being installed again. addsitedir reads the .pth files as
# well: saltus itself is installed by one.
.venv/bin/python -c 'import sysconfig; print("import site; site.addsitedir(%r)" % sysconfig.get_path("purelib"))' > \
    "$(.venv-peers/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/venv.pth"
.venv/bin/python -m pip --python .venv-peers/bin/python install --quiet --no-compile --require-hashes -r requirements-bench.lock
"""


def steps(number: int) -> tuple[Step, ...]:
    """The table, for a commit of this number: what is tried in turn hangs on it."""
    processor = ("avx2", "sse")[number % 2]
    share = (number // 2 % SHARES, SHARES)
    return (
        Step(
            "system",
            "a browser and node, where they may be installed",
            INSTALL_SYSTEM,
            10,
            may_fail=True,
        ),
        Step("test", "make test, which sets up .venv", "make test", 40),
        Step(
            "javascript",
            "types and style of the page's modules",
            f"command -v npm || exit {IMPOSSIBLE}\n"
            "npm ci --silent --ignore-scripts\nnpm run --silent types\nnpm run --silent lint",
            5,
        ),
        Step(
            "reproduce",
            "the paper with its report: whole where that takes 15 minutes here, else as a draft",
            'effort="$(.venv/bin/python -m saltus_paper.expected_time)"\n'
            'echo "effort: $effort"\n'
            '.venv/bin/saltus reproduce --effort "$effort"',
            30,
            counted=r"^paper: \S+ is (ready)",
        ),
        Step(
            "pages",
            "every page of the documentation and of the report, computed in node",
            f"command -v node || exit {IMPOSSIBLE}\n"
            ".venv/bin/python tests/web/every_page.py results",
            15,
            counted=r"^(\d+) pages agree",
        ),
        Step(
            "wheel",
            "the wheel in an empty environment: the README's blocks, the commands, a page",
            ".venv/bin/python -m venv --clear .venv-dist && .venv-dist/bin/pip install -q uv"
            " hatchling\n.venv-dist/bin/python release/try_wheel.py --newest --only"
            ' "$(.venv/bin/python -c "import sys; print(*sys.version_info[:2], sep=\'.\')")"',
            15,
            counted=r"(\d+) blocks of the README",
        ),
        Step(
            "docs",
            "the site, warnings are errors",
            "make docs",
            25,
            counted=r"^\s*generating gallery\.* \[\s*100%\] (\S+)",
        ),
        Step(
            "browser",
            "all tests in a browser, those of make thorough too",
            f"{PYTEST} -m 'thorough or not thorough' {BROWSER_TESTS}",
            12,
        ),
        Step(
            "peers",
            "JAX and Siconos, where they can be installed; PyTorch has no small wheel",
            f"{INSTALL_PEERS}\n"
            f"{PYTEST.replace('.venv', '.venv-peers')} tests/flow/test_in_jax.py "
            "tests/test_beside_siconos.py",
            12,
            may_be_cut=True,
        ),
        Step(
            "processor",
            f"the numerical tests on an emulated processor, in turn; now {processor}",
            f'test "$(uname -m)" = x86_64 || exit {IMPOSSIBLE}\n'
            f". tests/processors/{processor}.sh\n{PYTEST} {NUMERICAL} || {{ {EXPLAINED}; exit 1; }}",
            25,
            may_be_cut=True,
        ),
        Step(
            "thorough",
            f"share {share[0] + 1} of {share[1]} of make thorough",
            f"{PYTEST} -m thorough {' '.join(thorough_files(*share))}",
            25,
            may_be_cut=True,
        ),
    )


def thorough_files(share: int, shares: int) -> list[str]:
    """The test files of one share, every `shares`-th of those that have thorough tests."""
    files = [
        path
        for folder in ("tests", "reproduction/tests")
        for path in sorted((ROOT / folder).rglob("test_*.py"))
        if "mark.thorough" in path.read_text(encoding="utf-8")
    ]
    return [str(path.relative_to(ROOT)) for path in files[share::shares]]


def commit_number() -> int:
    """How many commits came before; in a shallow clone, which cannot know, a number of the
    commit.
    """

    def git(*arguments: str) -> str:
        return subprocess.run(
            ["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True
        ).stdout.strip()

    if git("rev-parse", "--is-shallow-repository") == "true":
        return int(git("rev-parse", "HEAD")[:8], 16)
    return int(git("rev-list", "--count", "HEAD"))


@dataclass
class Outcome:
    """What became of a step."""

    step: Step
    said: str  # passed, FAILED, cut, not run, impossible
    minutes: float = 0.0
    count: int = 0


def run(step: Step, minutes: float) -> Outcome:
    """Run a step for so many minutes at most; what it prints is printed, and counted."""
    start, count, cut = time.monotonic(), 0, threading.Event()
    process = subprocess.Popen(
        ["bash", "-euo", "pipefail", "-c", step.commands],
        cwd=ROOT,
        # of this checkout and of what it installs alone
        env={name: value for name, value in os.environ.items() if not name.startswith("PYTHON")},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        start_new_session=True,
    )

    def end() -> None:
        cut.set()
        os.killpg(process.pid, signal.SIGKILL)

    limit = threading.Timer(60.0 * minutes, end)
    limit.start()
    try:
        for line in process.stdout or ():
            print(line, end="", flush=True)
            for found in re.findall(step.counted, line):
                count += int(found) if found.isdigit() else 1
        status = process.wait()
    except BaseException:
        end()
        raise
    finally:
        limit.cancel()
    said = "cut" if cut.is_set() else {0: "passed", IMPOSSIBLE: "impossible"}.get(status, "FAILED")
    return Outcome(step, said, (time.monotonic() - start) / 60.0, count)


def run_all(chosen: Iterable[Step], begin_before: float = BEGIN_BEFORE, end: float = END) -> int:
    """Run these steps by the clock and say what became of them; the exit status."""
    start, outcomes = time.monotonic(), []
    for step in chosen:
        gone = (time.monotonic() - start) / 60.0
        if gone >= begin_before:
            outcomes.append(Outcome(step, "not run"))
            continue
        print(f"\n=== {step.name}: {step.what} (after {gone:.1f} min)", flush=True)
        limit = min(step.minutes, end - gone)
        outcome = run(step, limit)
        if outcome.said == "cut" and limit == step.minutes and not step.may_be_cut:
            outcome.said = f"FAILED (not done after {limit:.0f} min)"
        elif outcome.said == "FAILED" and step.may_fail:
            outcome.said = "impossible"
        outcomes.append(outcome)
    print(f"\n{'step':12} {'outcome':12} {'min':>6} {'tests':>6}  what")
    for outcome in outcomes:
        print(
            f"{outcome.step.name:12} {outcome.said:12} {outcome.minutes:6.1f} {outcome.count:6}  "
            f"{outcome.step.what}"
        )
    print(f"{(time.monotonic() - start) / 60.0:.1f} min in all")
    for said, words in (
        ("not run", "Not run, for want of time"),
        ("cut", "Cut by the clock"),
        ("impossible", "Not possible on this machine"),
    ):
        names = [outcome.step.name for outcome in outcomes if outcome.said == said]
        if names:
            print(f"{words}: {', '.join(names)}")
    failed = [outcome.step.name for outcome in outcomes if outcome.said.startswith("FAILED")]
    print(f"FAILED: {', '.join(failed)}" if failed else "Nothing failed.", flush=True)
    return int(bool(failed))


def main() -> int:
    """Run the table, or a part of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--list", action="store_true", help="show the table and stop")
    parser.add_argument("--only", nargs="+", metavar="STEP", help="run these steps alone")
    parser.add_argument(
        "--share",
        type=int,
        metavar="N",
        help=f"print a share of the thorough tests, below {SHARES}",
    )
    options = parser.parse_args()
    if options.share is not None:
        print(*thorough_files(options.share, SHARES))
        return 0
    table = steps(commit_number())
    if options.only:
        unknown = set(options.only) - {step.name for step in table}
        if unknown:
            parser.error(f"no step is called {', '.join(sorted(unknown))}; see --list")
        table = tuple(step for step in table if step.name in options.only)
    if options.list:
        for step in table:
            print(f"{step.name:12} {step.minutes:4.0f} min at most  {step.what}")
        return 0
    # so that what a step has started ends with this program
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended from outside"))
    return run_all(table)


if __name__ == "__main__":
    sys.exit(main())
