"""What the derivatives of an oscillation are called: symbols and words for figures and tables."""

from __future__ import annotations

from markupsafe import Markup

from levelone.aerodynamics.modes import LATERAL, LONGITUDINAL
from levelone.report.symbols import GREEK

#: coefficients that motions in the plane of symmetry change, and those that others change
LONGITUDINAL_COEFFICIENTS, LATERAL_COEFFICIENTS = ("C_L", "C_D", "C_m"), ("C_Y", "C_l", "C_n")
COEFFICIENTS = {"longitudinal": LONGITUDINAL_COEFFICIENTS, "lateral": LATERAL_COEFFICIENTS}
MOTIONS = {"longitudinal": LONGITUDINAL, "lateral": LATERAL}
WORDS = {
    "pitch": "pitch oscillation", "heave": "heave oscillation", "rate": "pure pitch rate (incidence constant)",
    "sideslip": "sideslip oscillation (heading constant)", "roll": "roll oscillation", "yaw": "yaw oscillation",
    "yaw_rate": "pure yaw rate (sideslip constant)",
}  # fmt: skip
STEADY_WORDS = {
    "alpha": "incidence, per rad", "q": "pitch rate, per <i>qc</i>/(2<i>V</i>)", "beta": "sideslip, per rad",
    "p": "roll rate, per <i>pb</i>/(2<i>V</i>)", "r": "yaw rate, per <i>rb</i>/(2<i>V</i>)",
}  # fmt: skip
# one level of subscripts: the dot of a second level cannot be seen, and C_Lalphadot would read as C_Lalpha
_SUFFIXES = {"alphadot": (r"\dot{\alpha}", "α̇"), "betadot": (r"\dot{\beta}", "β̇")}
_QUADRATURE = {
    "pitch": (("", "q"), (" + ", "alphadot")), "heave": (("", "alphadot"),), "rate": (("", "q"),), "sideslip": (("", "betadot"),),
    "roll": (("", "p"),), "yaw": (("", "r"), (" − ", "betadot")), "yaw_rate": (("", "r"),),
}  # fmt: skip


def quadrature(motion: str, coefficient: str) -> str:
    """Derivative that the out-of-phase part of a motion gives, for matplotlib: ``C_Lq + C_Lalphadot`` of a pitch oscillation."""
    axis = coefficient.removeprefix("C_")
    return "".join(f"{sign}$C_{{{axis}{_SUFFIXES.get(suffix, (suffix, ''))[0]}}}$" for sign, suffix in _QUADRATURE[motion])


def quadrature_html(motion: str, coefficient: str) -> Markup:
    """The same for the page."""
    return Markup("").join(Markup(sign) + symbol_html(coefficient, suffix) for sign, suffix in _QUADRATURE[motion])


def symbol_html(coefficient: str, suffix: str) -> Markup:
    """A derivative for the page: ``C_m`` and ``q`` become C_mq, with one level of subscripts."""
    letter = _SUFFIXES.get(suffix, ("", GREEK.get(suffix, suffix)))[1]
    return Markup("<i>C</i><sub><i>{}{}</i></sub>").format(coefficient.removeprefix("C_"), letter)
