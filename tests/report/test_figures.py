"""Histories, Bode plot, screening and Sobol bars: what is drawn is what the files hold."""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Annotation

from levelone.report import style
from levelone.report.bode import draw_bode, phase_beside, phase_deg
from levelone.report.histories import draw_quickness, draw_stability, draw_sweep
from levelone.report.indices import draw_indices
from levelone.report.results import Results
from levelone.report.screening import RATIOS, draw_screening

pytestmark = pytest.mark.usefixtures("paper")
DEG = 180.0 / math.pi


def texts(axes: Axes) -> list[str]:
    return [text.get_text() for text in axes.texts if text.get_text()]


def marks(axes: Axes) -> list[tuple[float, float]]:
    """Single points with a marker."""
    lines = [line for line in axes.lines if len(line.get_xdata()) == 1 and line.get_marker() == "o"]
    return [(float(line.get_xdata()[0]), float(line.get_ydata()[0])) for line in lines]


def draw(figure: Figure) -> None:
    """Any warning or error of the drawing itself shows here."""
    style.renderer(figure).clear()
    figure.draw(style.renderer(figure))


class TestHistories:
    def test_quickness_marks_what_the_criterion_read(self, results: Results) -> None:
        data = results.histories["attitude_quickness"]
        figure = draw_quickness(data)
        _, rate, attitude = figure.axes
        picks = data.attrs
        assert marks(rate)[0] == pytest.approx((picks["t_q_pk"], DEG * picks["q_pk"]))
        assert marks(rate)[1][0] == pytest.approx(picks["t_second"])
        assert marks(attitude) == [
            pytest.approx((picks["t_theta_pk"], DEG * picks["theta_pk"])),
            pytest.approx((picks["t_second"], DEG * picks["theta_second"])),
        ]
        assert texts(attitude) == [r"$\Delta\theta_{\mathrm{pk}}$", r"$\Delta\theta_{\mathrm{min}}$"]

    def test_names_of_peaks_stand_above_and_of_valleys_below(self, results: Results) -> None:
        figure = draw_stability(results.histories["dynamic_stability"])
        rate = figure.axes[1]
        notes = {note.get_text(): note for note in rate.texts if isinstance(note, Annotation)}
        assert [notes[name].get_va() for name in ("first peak", "first valley", "second peak")] == ["bottom", "top", "bottom"]
        attrs = results.histories["dynamic_stability"].attrs
        assert marks(rate) == [pytest.approx((attrs[f"t_{j}"], DEG * attrs[f"q_{j}"])) for j in (1, 2, 3)]

    def test_forced_part_is_shaded_up_to_the_free_response(self, results: Results) -> None:
        data = results.histories["dynamic_stability"]
        for panel in draw_stability(data).axes:
            band = panel.patches[0].get_extents().transformed(panel.transData.inverted())
            assert (band.x0, band.x1) == pytest.approx((data.attrs["input_on"], data.attrs["t_free"]))

    def test_every_run_is_drawn_with_the_nominal_one_in_front(self, results: Results) -> None:
        data = results.histories["attitude_quickness"]
        rate = draw_quickness(data).axes[1]
        traces = [line for line in rate.lines if len(line.get_xdata()) > 100]
        assert len(traces) == data.sizes["run"]
        front = max(traces, key=lambda line: line.get_zorder())
        at = np.searchsorted(data["time"].values, front.get_xdata())
        np.testing.assert_allclose(front.get_ydata(), DEG * data["q"].values[0, at])

    def test_undefined_picks_leave_no_mark(self, results: Results) -> None:
        data = results.histories["attitude_quickness"].copy()
        data.attrs |= {"t_second": math.nan, "theta_second": math.nan}
        figure = draw_quickness(data)
        draw(figure)
        assert len(marks(figure.axes[1])) == len(marks(figure.axes[2])) == 1
        free = results.histories["dynamic_stability"].copy()
        free.attrs |= {f"{name}_{j}": math.nan for name in "tq" for j in (1, 2, 3)}
        figure = draw_stability(free)
        draw(figure)
        assert marks(figure.axes[1]) == []

    def test_sweep_shows_the_whole_record(self, results: Results) -> None:
        data = results.histories["bandwidth"]
        figure = draw_sweep(data)
        assert figure.axes[0].get_xlim() == (data["time"].values[0], data["time"].values[-1])
        assert len(figure.axes[1].lines[0].get_xdata()) > 20.0 * 15.3 * 90.0 / (2.0 * math.pi) / 2.0


class TestBode:
    def test_phase_starts_within_half_a_turn_and_goes_on(self) -> None:
        omega = np.geomspace(0.01, 30.0, 400)
        value = np.exp(-0.3j * omega) / (1j * omega) ** 2 * -1.0
        np.testing.assert_allclose(phase_deg(value), -0.3 * DEG * omega, atol=1e-9)
        value[50] = math.nan
        assert np.flatnonzero(np.isnan(phase_deg(value))).tolist() == [50]

    def test_swept_phase_takes_the_branch_of_the_line(self) -> None:
        omega = np.linspace(1.0, 10.0, 50)
        line = -70.0 * omega
        swept = np.exp(1j * np.radians(line + 100.0 * np.sin(7.0 * omega)))
        np.testing.assert_allclose(phase_beside(omega, swept, omega, line), line + 100.0 * np.sin(7.0 * omega))

    def test_readings_are_marked_at_their_phase(self, results: Results) -> None:
        figure = draw_bode(results.linear, results.swept)
        phases = figure.axes[2:4]
        for panel, suffix in zip(phases, ("", "_attitude"), strict=True):
            expected = [
                (results.linear.attrs[name + suffix], level) for name, level in (("omega_bw", -135.0), ("omega_180", -180.0))
            ]
            assert marks(panel) == [pytest.approx(pair) for pair in expected]

    def test_undefined_readings_are_not_marked(self, results: Results) -> None:
        linear = results.linear.copy()
        linear.attrs |= dict.fromkeys(("omega_bw", "omega_180", "tau_p"), math.nan)
        figure = draw_bode(linear, results.swept)
        draw(figure)
        assert marks(figure.axes[2]) == []
        assert len(marks(figure.axes[3])) == 2
        assert not any("tau_p" in text for text in texts(figure.axes[2]))

    def test_a_failed_linearisation_still_shows_the_sweep(self, results: Results) -> None:
        linear = results.linear.copy(deep=True)
        for name in ("q_re", "q_im", "theta_re", "theta_im"):
            linear[name][:] = math.nan
        linear.attrs |= dict.fromkeys(linear.attrs, math.nan)
        figure = draw_bode(linear, results.swept)
        draw(figure)
        assert np.isfinite(figure.axes[0].lines[1].get_ydata()).all()

    def test_coherence_keeps_its_scale_and_limit(self, results: Results) -> None:
        figure = draw_bode(results.linear, results.swept)
        for panel in figure.axes[4:6]:
            assert panel.get_ylim() == (0.0, 1.05)
            assert any(set(line.get_ydata()) == {0.6} for line in panel.lines)


class TestScreening:
    def test_each_factor_has_its_point_and_its_label(self, results: Results) -> None:
        entry = results.responses["delta_theta_min"]
        figure = draw_screening("delta_theta_min", entry)
        panel = figure.axes[0]
        points = next(line for line in panel.lines if line.get_label() == "_factors")
        assert len(points.get_xdata()) == len(entry["morris"])
        np.testing.assert_allclose(points.get_xdata(), [DEG * item["mu_star"] for item in entry["morris"].values()])
        np.testing.assert_allclose(points.get_ydata(), [DEG * item["sigma"] for item in entry["morris"].values()])
        named = {note.get_text(): note.xy for note in panel.texts if isinstance(note, Annotation)}
        assert named[r"$\tau_{d}$"] == pytest.approx([DEG * entry["morris"]["tau_d"][key] for key in ("mu_star", "sigma")])
        assert len([text for text in named if text.startswith("$") and "sigma" not in text]) == len(entry["morris"])
        assert panel.get_xlabel().endswith("deg")

    def test_rays_have_their_slopes(self, results: Results) -> None:
        panel = draw_screening("zeta", results.responses["zeta"]).axes[0]
        rays = [line for line in panel.lines if str(line.get_label()).startswith("_ratio")]
        slopes = [line.get_ydata()[1] / line.get_xdata()[1] for line in rays]
        assert slopes == pytest.approx(RATIOS)

    def test_undefined_factor_is_left_out_and_all_undefined_is_said(self, results: Results) -> None:
        entry = copy.deepcopy(results.responses["zeta"])
        entry["morris"]["M"] |= {"mu_star": math.nan, "sigma": math.nan, "mu_star_ci": [math.nan] * 2, "sigma_ci": [math.nan] * 2}
        figure = draw_screening("zeta", entry)
        draw(figure)
        assert "$M$" not in texts(figure.axes[0])
        for item in entry["morris"].values():
            item |= {"mu_star": math.nan, "sigma": math.nan}
        entry["status"] = "no trim found"
        figure = draw_screening("zeta", entry)
        draw(figure)
        assert texts(figure.axes[0]) == ["undefined:\nno trim found"]

    def test_inert_model_has_a_frame(self, results: Results) -> None:
        entry = copy.deepcopy(results.responses["zeta"])
        for item in entry["morris"].values():
            item |= {"mu_star": 0.0, "sigma": 0.0, "mu_star_ci": [0.0, 0.0], "sigma_ci": [0.0, 0.0]}
        figure = draw_screening("zeta", entry)
        draw(figure)
        assert figure.axes[0].get_xlim()[1] == 1.0


class TestIndices:
    def test_bars_are_the_indices_sorted_by_total(self, results: Results) -> None:
        entries = results.of("dynamic_stability")
        figure = draw_indices(entries)
        for panel, entry in zip(figure.axes, entries.values(), strict=True):
            totals = sorted((item["ST"] for item in entry["sobol"].values()), reverse=True)
            total, first = panel.containers[:2]
            assert [bar.get_width() for bar in total] == pytest.approx(totals)
            order = sorted(entry["sobol"].values(), key=lambda item: -item["ST"])
            assert [bar.get_width() for bar in first] == pytest.approx([item["S1"] for item in order])
            assert len(panel.get_yticklabels()) == len(entry["sobol"])

    def test_bounding_values_are_drawn_where_runs_failed(self, results: Results) -> None:
        entries = results.of("dynamic_stability")
        drawn = [line for line in draw_indices(entries).axes[0].lines if line.get_color() == style.VERMILLION]
        (low, high), bounded = drawn, entries["zeta"]["sobol_bounded"]
        assert max(low.get_xdata()) == pytest.approx(max(item["ST"] for item in bounded["low"].values()))
        assert max(high.get_xdata()) == pytest.approx(max(item["ST"] for item in bounded["high"].values()))
        whole = {name: {**entry, "sobol_bounded": {}} for name, entry in entries.items()}
        figure = draw_indices(whole)
        assert not any(line.get_color() == style.VERMILLION for line in figure.axes[0].lines)
        assert len(figure.legends[0].get_texts()) == 2

    def test_undefined_indices_are_said_with_their_status(self, results: Results) -> None:
        entry = copy.deepcopy(results.responses["zeta"])
        for item in entry["sobol"].values():
            item |= {"S1": math.nan, "ST": math.nan, "S1_ci": [math.nan] * 2, "ST_ci": [math.nan] * 2}
        entry["surrogate"]["status"] = "too few runs"
        figure = draw_indices({"zeta": entry})
        draw(figure)
        assert texts(figure.axes[0]) == ["undefined:\ntoo few runs"]

    @pytest.mark.parametrize(("count", "panels"), [(1, 1), (2, 2), (3, 3), (4, 4), (5, 6)])
    def test_panels_follow_the_number_of_responses(self, results: Results, count: int, panels: int) -> None:
        entries = dict(list(results.responses.items())[:count])
        figure = draw_indices(entries)
        draw(figure)
        assert len(figure.axes) == panels
        assert sum(panel.axison for panel in figure.axes) == count
