"""Level regions: the boundaries drawn are those of the file, and the colours agree with the Levels."""

from __future__ import annotations

import copy
import math
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.lines import Line2D

from levelone.handling.levels import Level, load_boundaries
from levelone.report import regions, style
from levelone.report.planes import draw_bandwidth_plane, draw_quickness_plane, draw_stability_plane
from levelone.report.results import Results

pytestmark = pytest.mark.usefixtures("paper")
BOUNDARIES = load_boundaries()
PITCH = BOUNDARIES.chart("attitude_quickness", "pitch")
OTHER = BOUNDARIES.chart("bandwidth", "all_other")
DAMPING = BOUNDARIES.dynamic_stability
DEG = 180.0 / math.pi


def lines(panel: Axes, label: str) -> list[Line2D]:
    return [line for line in panel.lines if line.get_label() == label]


def xy(line: Line2D) -> np.ndarray:
    return np.column_stack([line.get_xdata(), line.get_ydata()])


def colour_at(panel: Axes, point: np.ndarray) -> str:
    """Colour of the topmost region over a point; white without one."""
    found = [(0.0, "#ffffff")]
    for patch in panel.patches:
        if patch.get_path().contains_point(point):
            found.append((patch.get_zorder(), to_hex(patch.get_facecolor())))
    for collection in panel.collections:
        if any(path.contains_point(point) for path in collection.get_paths()):
            found.append((collection.get_zorder(), to_hex(collection.get_facecolor()[0])))
    return max(found)[1]


def expected(level: int) -> str:
    return "#ffffff" if level == Level.OUTSIDE else style.LEVEL_COLOURS[level - 1]


def alter(results: Results, response: str, **changes: object) -> Results:
    summary = copy.deepcopy(dict(results.summary))
    summary["responses"][response] |= changes
    return replace(results, summary=summary)


def small_print(figure: object) -> str:
    return " ".join(text.get_text() for text in figure.texts)  # type: ignore[attr-defined]


def key(figure: object) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]  # type: ignore[attr-defined]


class TestQuickness:
    def test_boundaries_are_those_of_the_file(self, results: Results) -> None:
        panel = draw_quickness_plane(results, PITCH).axes[0]
        for name in ("level_1_2", "level_2_3"):
            (line,) = lines(panel, f"_{name}")
            points = getattr(PITCH, name)
            np.testing.assert_allclose(xy(line), np.column_stack([DEG * points[:, 0], points[:, 1]]))

    def test_unverified_is_dash_dotted_and_the_extension_dashed(self, results: Results) -> None:
        figure = draw_quickness_plane(results, PITCH)
        panel = figure.axes[0]
        (line,) = lines(panel, "_level_1_2")
        assert line._dash_pattern[1] == pytest.approx([0.9 * part for part in (6, 1.5, 1, 1.5)])
        extended = lines(panel, "_level_1_2 extended")
        assert {tuple(extension.get_xdata()[:2].round(6)) for extension in extended} >= {(5.5, 0.0)}
        assert "boundary, unverified" in key(figure)
        sure = draw_quickness_plane(results, replace(PITCH, confidence="high"))
        assert lines(sure.axes[0], "_level_1_2")[0].get_linestyle() == "-"
        assert "boundary, unverified" not in key(sure)

    def test_extension_meets_the_limits(self, results: Results) -> None:
        panel = draw_quickness_plane(results, PITCH).axes[0]
        for index, name in enumerate(("level_1_2", "level_2_3")):
            for line in lines(panel, f"_{name} extended"):
                np.testing.assert_allclose(line.get_ydata(), PITCH.limits(line.get_xdata() / DEG)[index])

    def test_colours_are_the_levels(self, results: Results) -> None:
        panel = draw_quickness_plane(results, PITCH).axes[0]
        rng = np.random.default_rng(5)
        points = rng.random((200, 2)) * [panel.get_xlim()[1], panel.get_ylim()[1]]
        levels, _ = PITCH.levels(points[:, 0] / DEG, points[:, 1])
        assert set(levels.tolist()) == {0, 1, 2, 3}
        assert [colour_at(panel, point) for point in points] == [expected(level) for level in levels]

    def test_runs_nominal_point_and_count_of_undefined(self, results: Results) -> None:
        figure = draw_quickness_plane(results, PITCH)
        panel = figure.axes[0]
        runs = xy(lines(panel, "_runs")[0])
        np.testing.assert_allclose(runs[:, 0], DEG * results.sample("delta_theta_min"))
        nominal = results.responses
        assert xy(lines(panel, "_nominal")[0])[0] == pytest.approx(
            [DEG * nominal["delta_theta_min"]["nominal"], nominal["quickness"]["nominal"]]
        )
        missing = int(np.isnan(runs).any(axis=1).sum())
        assert missing > 0
        assert f"{missing} of 500 Monte Carlo runs are undefined and not drawn." in small_print(figure)
        assert "velocity-command" in small_print(figure)
        assert "full-scale helicopters" in small_print(figure)

    def test_undefined_nominal_is_said(self, results: Results) -> None:
        figure = draw_quickness_plane(alter(results, "quickness", nominal=math.nan), PITCH)
        assert "nominal: undefined" in key(figure)

    def test_closer_view_shows_the_runs_and_gives_way_to_wide_data(self, results: Results) -> None:
        panel = draw_quickness_plane(results, PITCH).axes[0]
        (inset,) = panel.child_axes
        known = xy(lines(inset, "_runs")[0])
        known = known[np.isfinite(known).all(axis=1)]
        (left, right), (low, high) = inset.get_xlim(), inset.get_ylim()
        assert ((known > [left, low]) & (known < [right, high])).all(axis=1).mean() > 0.9
        wide = replace(results, monte_carlo=results.monte_carlo.copy(deep=True))
        wide.monte_carlo["values"][:, 1] *= 4.0
        assert draw_quickness_plane(wide, PITCH).axes[0].child_axes == []

    def test_closer_view_covers_no_outlier(self, results: Results) -> None:
        some = replace(results, monte_carlo=results.monte_carlo.copy(deep=True))
        some.monte_carlo["values"][:3, 1] = np.radians([15.0, 17.0, 20.0])
        some.monte_carlo["values"][:3, 0] = 1.0
        panel = draw_quickness_plane(some, PITCH).axes[0]
        (inset,) = panel.child_axes
        assert inset.get_xlim()[1] < 5.5
        some.monte_carlo["values"][:3, 0] = 3.0
        assert draw_quickness_plane(some, PITCH).axes[0].child_axes == []

    def test_all_runs_undefined(self, results: Results) -> None:
        none = replace(results, monte_carlo=results.monte_carlo.copy(deep=True))
        none.monte_carlo["values"][:] = math.nan
        figure = draw_quickness_plane(none, PITCH)
        assert "500 of 500" in small_print(figure)
        assert "500 of 500" in small_print(draw_stability_plane(none, DAMPING))
        assert "500 of 500" in small_print(draw_bandwidth_plane(none, OTHER))


class TestStability:
    def test_limits_follow_the_file(self) -> None:
        first, second = regions.damping_curves(DAMPING, 20.0)
        omega = np.hypot(*first[1:].T)
        zeta = -first[1:, 0] / omega
        assert zeta[-1] == pytest.approx(DAMPING.zeta_1)
        assert zeta[0] == pytest.approx(DAMPING.zeta_below_corner)
        assert omega[:-1] == pytest.approx(DAMPING.corner)
        np.testing.assert_allclose(second[:, 0], DAMPING.growth)

    def test_colours_are_the_levels(self, results: Results) -> None:
        panel = draw_stability_plane(results, DAMPING).axes[0]
        rng = np.random.default_rng(6)
        wide = rng.random((300, 2)) * [6.0, 8.0] - [4.0, 0.0]
        near = rng.random((300, 2)) * [0.8, 0.8] - [0.4, 0.0]
        points = np.vstack([wide, near])
        omega = np.hypot(*points.T)
        levels = DAMPING.levels(omega, -points[:, 0] / omega)
        assert set(levels.tolist()) == {1, 2, 3}
        assert [colour_at(panel, point) for point in points] == [expected(level) for level in levels]

    def test_confirmed_and_unverified_parts_differ(self, results: Results) -> None:
        figure = draw_stability_plane(results, DAMPING)
        panel = figure.axes[0]
        assert lines(panel, "_level_1_2")[0].get_linestyle() == "-"
        assert lines(panel, "_level_2_3")[0].get_linestyle() != "-"
        assert key(figure)[2:] == ["boundary, confirmed", "boundary, unverified"]

    def test_runs_are_poles(self, results: Results) -> None:
        panel = draw_stability_plane(results, DAMPING).axes[0]
        runs = xy(lines(panel, "_runs")[0])
        np.testing.assert_allclose(np.hypot(*runs.T), results.sample("omega_n"))
        np.testing.assert_allclose(-runs[:, 0] / np.hypot(*runs.T), results.sample("zeta") + 0.0 * results.sample("omega_n"))

    def test_beyond_critical_damping_there_is_no_pole_pair(self) -> None:
        assert np.isnan(regions.pole(np.array([2.0]), np.array([1.2]))[0, 1])


class TestBandwidth:
    def test_abscissa_of_the_file_is_vertical(self, results: Results) -> None:
        figure = draw_bandwidth_plane(results, OTHER)
        for panel in figure.axes:
            np.testing.assert_allclose(xy(lines(panel, "_level_1_2")[0]), OTHER.level_1_2[:, ::-1])
            rng = np.random.default_rng(7)
            points = rng.random((200, 2)) * [2.0, panel.get_ylim()[1]]
            levels, _ = OTHER.levels(points[:, 1], points[:, 0])
            assert set(levels.tolist()) == {0, 1, 2, 3}
            assert [colour_at(panel, point) for point in points] == [expected(level) for level in levels]

    def test_each_panel_has_its_reading(self, results: Results) -> None:
        figure = draw_bandwidth_plane(results, OTHER)
        for panel, suffix in zip(figure.axes, ("_attitude", ""), strict=True):
            np.testing.assert_allclose(xy(lines(panel, "_runs")[0])[:, 0], results.sample("omega_bw" + suffix))
        assert "sets the Level" in figure.axes[0].get_title()
        assert "not the standard's" in figure.axes[1].get_title()

    def test_regions_are_named_once_away_from_the_runs(self, results: Results) -> None:
        figure = draw_bandwidth_plane(results, OTHER)
        for panel in figure.axes:
            words = [text.get_text() for text in panel.texts]
            assert [words.count(f"Level {k}") for k in (1, 2, 3)] == [1, 1, 1]
            place = next(text for text in panel.texts if text.get_text() == "Level 1").get_position()
            runs = panel.transAxes.inverted().transform(panel.transData.transform(xy(lines(panel, "_runs")[0])))
            assert np.nanmin(np.hypot(*(runs - place).T)) > 0.1
