from __future__ import annotations

import math
from html.parser import HTMLParser

import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.mathtext import MathTextParser

from levelone.report import symbols
from levelone.report.formatting import interval, number, percent, percent_interval


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("M", "$M$"),
        ("I_y", "$I_{y}$"),
        ("I_xz", "$I_{xz}$"),
        ("tau_d", r"$\tau_{d}$"),
        ("rho", r"$\rho$"),
        ("C_L0", "$C_{L_{0}}$"),
        ("C_Lalpha", r"$C_{L_{\alpha}}$"),
        ("C_malphadot", r"$C_{m_{\dot{\alpha}}}$"),
        ("C_mq", "$C_{m_{q}}$"),
        ("quickness", r"$q_{\mathrm{pk}}/\Delta\theta_{\mathrm{pk}}$"),
        ("motor_lag", "motor_lag"),
        ("5 $ a_b", r"5 \$ a_b"),
    ],
)
def test_mathtext(name: str, expected: str) -> None:
    assert symbols.mathtext(name) == expected


@pytest.mark.parametrize(
    "name", ["M", "T_u", "I_xz", "C_L0", "C_malphadot", "C_D", "omega_n", "quickness", "omega_bw", "tau_p_attitude"]
)
def test_mathtext_is_understood_by_matplotlib(name: str) -> None:
    parsed = MathTextParser("path").parse(symbols.mathtext(name))
    assert parsed.width > 0.0


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("C_Lalpha", "<i>C</i><sub><i>L</i><sub><i>α</i></sub></sub>"),
        ("C_L0", "<i>C</i><sub><i>L</i><sub>0</sub></sub>"),
        ("tau_d", "<i>τ</i><sub><i>d</i></sub>"),
        ("motor_lag", "motor_lag"),
        ("C_L<script>", "C_L&lt;script&gt;"),
    ],
)
def test_html(name: str, expected: str) -> None:
    assert symbols.html(name) == expected


@given(st.text(alphabet="CLDmIKT_<>&'\"/ script0123alpha", max_size=20))
def test_html_of_any_name_holds_symbols_only(name: str) -> None:
    tags: list[str] = []

    class Tags(HTMLParser):
        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            tags.append(tag)
            assert not attrs

    parser = Tags()
    parser.feed(str(symbols.html(name)))
    parser.close()
    assert set(tags) <= {"i", "sub"}


def test_angles_are_shown_in_degrees_and_frequencies_are_not() -> None:
    scale, unit = symbols.field_unit("rad")
    assert scale * math.pi == pytest.approx(180.0, rel=1e-15)
    assert unit == "deg"
    assert symbols.field_unit("rad/s") == (1.0, "rad/s")


def test_readings_of_bandwidth_differ_on_axes() -> None:
    assert symbols.axis_label("omega_bw", "rad/s") == r"$\omega_{\mathrm{BW}}$ of $q/V_{\mathrm{lon}}$, rad/s"
    assert symbols.axis_label("omega_bw_attitude", "rad/s") == r"$\omega_{\mathrm{BW}}$ of $-\theta/V_{\mathrm{lon}}$, rad/s"
    assert symbols.axis_label("zeta", "1") == r"$\zeta$"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (math.nan, "undefined"),
        (math.inf, "∞"),
        (-math.inf, "−∞"),
        (0.0, "0"),
        (-1.5, "−1.5"),
        (6.96e-8, "6.96·10⁻⁸"),
        (-1.234567e12, "−1.235·10¹²"),
        (2.87654, "2.877"),
    ],
)
def test_number(value: float, text: str) -> None:
    assert number(value) == text


def test_shares_near_their_ends_do_not_read_as_certain() -> None:
    assert percent(1.0) == "100.0 %"
    assert percent(0.9999) == "99.99 %"
    assert percent(0.0001) == "0.01 %"
    assert percent(math.nan) == "undefined"
    assert percent_interval([0.25, 0.5]) == "25.0 to 50.0 %"
    assert percent_interval([math.nan, math.nan]) == interval([math.nan, math.nan]) == "undefined"
    assert interval([-0.5, 0.25]) == "−0.5 to 0.25"
