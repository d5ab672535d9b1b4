from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from levelone.report import style
from levelone.report.labels import group, label_points, place

BOUNDS = np.array([0.0, 0.0, 240.0, 180.0])
NO_LINES = np.zeros((0, 4))


def overlap(centres: np.ndarray, sizes: np.ndarray, others: np.ndarray, their_sizes: np.ndarray) -> float:
    reach = 0.5 * (sizes[:, None] + their_sizes[None]) - np.abs(centres[:, None] - others[None])
    return float(np.prod(np.clip(reach, 0.0, None), axis=2).sum())


def test_alone_a_label_stands_at_its_point() -> None:
    point, size = np.array([[100.0, 90.0]]), np.array([[16.0, 9.0]])
    centre = place(point, size, BOUNDS, NO_LINES)[0]
    gap = np.abs(centre - point[0]) - 0.5 * size[0]
    assert 0.0 < max(gap) < 4.0


def test_crowd_at_the_origin_is_resolved() -> None:
    rng = np.random.default_rng(1)
    points = np.vstack([rng.random((9, 2)) * 9.0 + 12.0, [[120.0, 20.0], [200.0, 150.0], [205.0, 148.0]]])
    sizes = np.tile([[17.0, 9.0]], (len(points), 1))
    centres = place(points, sizes, BOUNDS, NO_LINES)
    own = len(points) * 17.0 * 9.0
    assert overlap(centres, sizes, centres, sizes) == pytest.approx(own)
    assert overlap(centres, sizes, points, np.full((len(points), 2), 3.6)) == 0.0


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.floats(5.0, 235.0), st.floats(5.0, 175.0)), min_size=1, max_size=8))
def test_labels_stay_inside_and_do_not_depend_on_the_call(pairs: list[tuple[float, float]]) -> None:
    points = np.array(pairs)
    sizes = np.tile([[15.0, 9.0]], (len(points), 1))
    centres = place(points, sizes, BOUNDS, NO_LINES)
    assert (centres - 0.5 * sizes >= BOUNDS[:2]).all()
    assert (centres + 0.5 * sizes <= BOUNDS[2:]).all()
    np.testing.assert_array_equal(centres, place(points.copy(), sizes, BOUNDS, NO_LINES))


def test_labels_keep_off_lines_where_there_is_room() -> None:
    point, size = np.array([[100.0, 90.0]]), np.array([[16.0, 9.0]])
    free = place(point, size, BOUNDS, NO_LINES)[0]
    through = np.array([[free[0] - 30.0, free[1], free[0] + 30.0, free[1]]])
    moved = place(point, size, BOUNDS, through)[0]
    assert abs(moved[1] - free[1]) > 0.5 * size[0, 1]


def test_points_that_print_on_top_of_each_other_share_a_block() -> None:
    points = np.array([[10.0, 10.0], [11.0, 10.5], [100.0, 90.0], [10.0, 12.0], [101.0, 90.0], [20.0, 10.0]])
    assert group(points) == [[0, 1, 3], [2], [4], [5]]
    assert group(points[:0]) == []


@pytest.mark.usefixtures("paper")
def test_labels_of_a_block_stand_in_rows_apart_from_each_other() -> None:
    figure, axes = style.sheet(style.COLUMN, 2.8)
    panel = axes[0, 0]
    panel.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    x = np.full(5, 0.02) + 1e-4 * np.arange(5)
    notes = label_points(panel, x, x, ["$M$", "$C_{L_0}$", "$I_y$", "$K_T$", "$C_{m_q}$"])
    boxes = [note.get_window_extent(style.renderer(figure)) for note in notes]
    assert not any(box.overlaps(other) for i, box in enumerate(boxes) for other in boxes[i + 1 :])
    rows = [round(0.5 * (box.y0 + box.y1)) for box in boxes]
    assert rows[0] == rows[1] == rows[2] > rows[3] == rows[4]
    leaders = [text for text in panel.texts if getattr(text, "arrow_patch", None) is not None]
    assert len(leaders) == 1


@pytest.mark.usefixtures("paper")
def test_written_labels_lie_where_they_were_placed() -> None:
    figure, axes = style.sheet(style.COLUMN, 2.8)
    panel = axes[0, 0]
    panel.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    x = np.array([0.1, 0.11, 0.12, 0.8])
    notes = label_points(panel, x, x, ["$M$", "$I_y$", "plain_$ 5", "$K_T$"])
    boxes = [note.get_window_extent(style.renderer(figure)) for note in notes]
    for i, box in enumerate(boxes):
        assert panel.bbox.x0 <= box.x0
        assert box.x1 <= panel.bbox.x1
        assert not any(box.overlaps(other) for other in boxes[i + 1 :])
    assert label_points(panel, x[:0], x[:0], []) == []
