"""Names of files to the symbols and units of the field: mathtext for figures, HTML for tables."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

from markupsafe import Markup, escape

GREEK = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "zeta": "ζ", "eta": "η", "theta": "θ", "lambda": "λ", "mu": "μ",
    "rho": "ρ", "sigma": "σ", "tau": "τ", "phi": "φ", "psi": "ψ", "omega": "ω",
}  # fmt: skip

_BASES = ("M", "I", "K", "T", "C", "S", "V", "k", "q", "p", "r", *GREEK)
_AXES = ("L", "D", "m", "Y", "l", "n", "X", "Z", "T", "P")
_COEFFICIENT = re.compile(rf"C_({'|'.join(_AXES)})(.*)")

_SPECIAL = {
    "quickness": (r"q_{\mathrm{pk}}/\Delta\theta_{\mathrm{pk}}", "<i>q</i><sub>pk</sub>/Δ<i>θ</i><sub>pk</sub>"),
    "delta_theta_min": (r"\Delta\theta_{\mathrm{min}}", "Δ<i>θ</i><sub>min</sub>"),
    "delta_theta_pk": (r"\Delta\theta_{\mathrm{pk}}", "Δ<i>θ</i><sub>pk</sub>"),
    "omega_bw": (r"\omega_{\mathrm{BW}}", "<i>ω</i><sub>BW</sub>"),
    "omega_bw_attitude": (r"\omega_{\mathrm{BW}}", "<i>ω</i><sub>BW</sub>"),
    "omega_bw_gain": (r"\omega_{\mathrm{BW,gain}}", "<i>ω</i><sub>BW,gain</sub>"),
    "omega_bw_gain_attitude": (r"\omega_{\mathrm{BW,gain}}", "<i>ω</i><sub>BW,gain</sub>"),
    "omega_bw_phase": (r"\omega_{\mathrm{BW,phase}}", "<i>ω</i><sub>BW,phase</sub>"),
    "tau_p_attitude": (r"\tau_p", "<i>τ</i><sub>p</sub>"),
    "omega_180": (r"\omega_{180}", "<i>ω</i><sub>180</sub>"),
    "coherence": (r"\gamma^2_{xy}", "<i>γ</i>²<sub>xy</sub>"),
    **{
        f"delta_{angle}_{at}": (rf"\Delta\{angle}_{{\mathrm{{{at}}}}}", f"Δ<i>{GREEK[angle]}</i><sub>{at}</sub>")
        for angle in ("phi", "psi")
        for at in ("min", "pk")
    },
    "omega_bw_swept": (r"\omega_{\mathrm{BW}}", "<i>ω</i><sub>BW</sub>"),
    "tau_p_swept": (r"\tau_p", "<i>τ</i><sub>p</sub>"),
    "rise_time": (r"T_{\mathrm{eq}}", "<i>T</i><sub>eq</sub>"),
    "overshoot": (r"\Delta V_{\mathrm{os}}/\Delta V", "Δ<i>V</i><sub>os</sub>/Δ<i>V</i>"),
    "ratio": (r"\Delta\phi_{\mathrm{pk}}/\Delta\theta_{\mathrm{pk}}", "Δ<i>φ</i><sub>pk</sub>/Δ<i>θ</i><sub>pk</sub>"),
}

_TITLES = {
    "quickness": "Attitude quickness",
    "delta_theta_min": "Minimum attitude change",
    "delta_theta_pk": "Peak attitude change",
    "zeta": "Damping ratio",
    "omega_n": "Natural frequency",
    "omega_bw": "Bandwidth of q / V_lon",
    "tau_p": "Phase delay of q / V_lon",
    "omega_bw_attitude": "Bandwidth of −θ / V_lon",
    "tau_p_attitude": "Phase delay of −θ / V_lon",
    "omega_bw_swept": "Bandwidth of q / V_lon, swept",
    "tau_p_swept": "Phase delay of q / V_lon, swept",
    "rise_time": "Rise time of the ground speed",
    "overshoot": "Overshoot of the ground speed",
    "ratio": "Roll for pitch",
}

CRITERION_TITLES = {
    "attitude_quickness": "Attitude quickness",
    "dynamic_stability": "Dynamic stability",
    "bandwidth": "Bandwidth and phase delay",
    "translational_rate": "Translational rate response",
    "pitch_roll_coupling": "Pitch-roll coupling",
    "worst": "Worst of the three",
}

_READINGS = (("_attitude", r"-\theta/V_{\mathrm{lon}}"), ("", r"q/V_{\mathrm{lon}}"))
_FIELD_UNITS = {"rad": (180.0 / math.pi, "deg"), "1": (1.0, "")}


@dataclass(frozen=True)
class Naming:
    """How a response of a model of one's own is called: in words, by the symbol of its quantity, and by its test where several have
    one.
    """

    title: str
    quantity: str
    test: str = ""


_NAMINGS: ContextVar[Mapping[str, Naming] | None] = ContextVar("namings", default=None)


@contextmanager
def naming(responses: Mapping[str, Naming]) -> Iterator[None]:
    """Call responses by these names, and not by those of the built-in vehicle's, while the block runs."""
    token = _NAMINGS.set(responses)
    try:
        yield
    finally:
        _NAMINGS.reset(token)


def _named(response: str) -> Naming | None:
    return (_NAMINGS.get() or {}).get(response)


def mathtext(name: str) -> str:
    """Symbol of a factor or response for matplotlib; a name without one comes back as plain text."""
    own = _named(name)
    if own is not None and own.quantity != name:
        return mathtext(own.quantity) + (f" ({own.test})" if own.test else "")
    if name in _SPECIAL:
        return f"${_SPECIAL[name][0]}$"
    parts = _parts(name)
    if parts is None:
        return name.replace("$", r"\$")
    return "$" + "_{".join(_tex(part) for part in parts) + "}" * (len(parts) - 1) + "$"


def html(name: str) -> Markup:
    """Symbol of a factor or response for the page; a name without one comes back escaped."""
    own = _named(name)
    if own is not None and own.quantity != name:
        return html(own.quantity) + (Markup(" ({})").format(own.test) if own.test else "")
    if name in _SPECIAL:
        return Markup(_SPECIAL[name][1])  # constants of this module
    parts = _parts(name)
    if parts is None:
        return escape(name)
    text = "<sub>".join(_tag(part) for part in parts) + "</sub>" * (len(parts) - 1)
    return Markup(text)  # letters, digits and Greek only: see _parts


def title(response: str) -> str:
    """A response in words; its name where it has none."""
    own = _named(response)
    return own.title if own is not None else _TITLES.get(response, response)


def axis_label(response: str, unit: str) -> str:
    """Symbol and unit for an axis, with the reading where a symbol has two: ``ω_BW of q/V_lon, rad/s``."""
    shown = field_unit(unit)[1]
    text = mathtext(response)
    if _NAMINGS.get() is None and response.startswith(("omega_bw", "tau_p")):
        text += " of $" + next(label for suffix, label in _READINGS if response.endswith(suffix)) + "$"
    return f"{text}, {shown}" if shown else text


def field_unit(unit: str) -> tuple[float, str]:
    """Factor from SI to the unit that the field reads, and its name: angles in deg, frequencies in rad/s."""
    return _FIELD_UNITS.get(unit, (1.0, unit))


def _parts(name: str) -> tuple[str, ...] | None:
    """Base, subscript, subscript of the subscript; letters, digits and dots only. None for a name without a symbol."""
    coefficient = _COEFFICIENT.fullmatch(name)
    if coefficient and re.fullmatch(r"[A-Za-z0-9]*", coefficient[2]):
        return ("C", coefficient[1], coefficient[2]) if coefficient[2] else ("C", coefficient[1])
    base, _, below = name.partition("_")
    if base in _BASES and re.fullmatch(r"[A-Za-z0-9]*", below):
        return (base, below) if below else (base,)
    return None


def _tex(part: str) -> str:
    stem = part.removesuffix("dot")
    letter = "\\" + stem if stem in GREEK else stem
    if stem and part.endswith("dot"):
        return rf"\dot{{{letter}}}"
    if part in GREEK:
        return letter
    return part if len(part) == 1 or part.isdigit() or part in ("xz", "yy", "xx", "zz") else rf"\mathrm{{{part}}}"


def _tag(part: str) -> str:
    stem = part.removesuffix("dot")
    if stem and part.endswith("dot"):
        return f"<i>{GREEK.get(stem, stem)}</i>\u0307"
    if part in GREEK:
        return f"<i>{GREEK[part]}</i>"
    return f"<i>{part}</i>" if len(part) == 1 and part.isalpha() else part
