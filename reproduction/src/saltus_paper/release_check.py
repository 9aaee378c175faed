"""`make release-check`: every claim of the tables judged at full size, from a folder in which
nothing is made yet.

It takes about as long as `saltus reproduce`. The everyday tests judge the claims that are fast, and
quick versions of the others.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory

from saltus_paper.claims.claim import Claim, ClaimVerdict, with_summaries
from saltus_paper.claims.claim_tables import claim_tables
from saltus_paper.reproduction import reproduce


def failures(claims: Iterable[Claim]) -> list[str]:
    """A line for each claim that fails and has no erratum that holds, and for each claim of the
    tables that was not judged.
    """
    found = {claim.id: claim for claim in claims}
    wrong = [
        f"{id} disagrees: {claim.evidence}"
        for id, claim in found.items()
        if claim.verdict is ClaimVerdict.DISAGREES
    ]
    known = [(part, id) for part, entries in claim_tables().items() for id in entries]
    return wrong + [f"{id} of {part} was not judged" for part, id in known if id not in found]


def check_release(folder: Path) -> int:
    """Reproduce the whole paper into `folder` and print what fails; the exit status, 1 if anything
    does.
    """
    results = reproduce(
        (),
        folder,
        force=True,
        progress=lambda fraction, what: print(f"{fraction:4.0%}  {what}", flush=True),
    )
    lines = [f"{result.name} failed: {result.error}" for result in results if result.error]
    lines += failures(with_summaries(claim for result in results for claim in result.claims))
    print(*lines, sep="\n")
    print(f"{len(lines)} failures." if lines else "Every claim was judged, and none disagrees.")
    return int(bool(lines))


if __name__ == "__main__":
    with TemporaryDirectory(prefix="saltus-release-") as temporary:
        sys.exit(check_release(Path(temporary)))
