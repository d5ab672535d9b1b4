"""The report's further sections: each shows one block of the results, and nothing where a study has none."""

from __future__ import annotations

from typing import Any

from levelone.report import (
    amplitudes,
    cases,
    certainty,
    comparison,
    coupling,
    deceleration,
    delay,
    direct,
    epistemic,
    froude,
    translation,
)
from levelone.report.pictures import Picture
from levelone.report.results import Results

#: name in the template -> module with ``context`` and ``pictures``, in the order of the page, and the title in its contents
SECTIONS: dict[str, tuple[Any, str, str]] = {
    "translation": (translation, "translational_rate", "Translational rate"),
    "delay": (delay, "without_delay", "Without delay"),
    "froude": (froude, "froude", "Scaled limits"),
    "deceleration": (deceleration, "deceleration", "Deceleration to hover"),
    "cases": (cases, "cases", "Cases"),
    "coupling": (coupling, "coupling", "Coupling"),
    "amplitudes": (amplitudes, "amplitudes", "Amplitudes"),
    "certainty": (certainty, "certainty", "Trust in surrogates"),
    "direct": (direct, "direct", "Indices of the model itself"),
    "epistemic": (epistemic, "epistemic", "Unknown and varying"),
    "comparison": (comparison, "comparison", "Findings"),
}


def contexts(results: Results) -> dict[str, Any]:
    """What the template needs of each section, None for one that the results lack; and the page's links to the others."""
    found = {name: module.context(results) for name, (module, _, _) in SECTIONS.items()}
    links = [(anchor, title) for name, (_, anchor, title) in SECTIONS.items() if found[name] is not None]
    return {**found, "further": links}


def further_pictures(results: Results) -> list[Picture]:
    """The pictures of the sections that the results have, in the order of the page."""
    return [
        picture for module, _, _ in SECTIONS.values() if module.context(results) is not None for picture in module.pictures(results)
    ]
