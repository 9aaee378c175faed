"""The verdicts on measures made by hand."""

from saltus_paper.claims.claim import judge_claim
from saltus_paper.claims.claim_tables import claim_tables

ENTRIES = {id: entry for claims in claim_tables().values() for id, entry in claims.items()}


def claims_of(measures):
    """The claims of any measures by id, whether or not they are all of a part."""
    return {
        id: judge_claim(id, ENTRIES[id], one) for id, one in measures.items() if one is not None
    }


def verdicts(measures):
    return {id: claim.verdict for id, claim in claims_of(measures).items()}
