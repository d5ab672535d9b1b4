"""The study's findings as rules: one function a claim, from the results of a study to a decision.

Rules are fixed by the file of findings; where their words leave room, docs/reference/comparison.md says how they are read.
"""

from levelone.campaign.claims import attitude, bandwidth, damping, quickness, sections
from levelone.campaign.claims.decision import Claim, Decision
from levelone.campaign.claims.evidence import Evidence

CLAIMS: dict[str, Claim] = {
    each.id: each for module in (quickness, attitude, damping, bandwidth, sections) for each in module.CLAIMS
}
"""Every programmed claim by its name."""

__all__ = ["CLAIMS", "Claim", "Decision", "Evidence"]
