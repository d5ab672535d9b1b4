from __future__ import annotations

import re

import pytest

from levelone.report import style
from levelone.report.svg import inline


@pytest.fixture
def text(tmp_path: object) -> str:
    with style.paper():
        figure, axes = style.sheet(2.0, 1.5)
        axes[0, 0].plot([0.0, 1.0, 2.0], [1.0, 0.0, 3.0], "o-")
        axes[0, 0].set_xlabel("a <b> -- c $\\mu^*$")
        path = tmp_path / "a.svg"  # type: ignore[operator]
        path.write_bytes(style.svg_of(figure))
    return path.read_text(encoding="utf-8")


def test_only_the_element_is_left(text: str) -> None:
    result = inline(text, "pic")
    assert result.startswith('<svg viewBox="0 0 144 108">')
    assert result.endswith("</svg>")
    for unwanted in ("<?xml", "<!DOCTYPE", "<!--", "metadata", "http", "xmlns", "<style", "xlink:"):
        assert unwanted not in result


def test_identifiers_are_prefixed_and_every_reference_resolves(text: str) -> None:
    result = inline(text, "pic")
    identifiers = re.findall(r'\bid="([^"]+)"', result)
    assert len(identifiers) == len(set(identifiers)) > 5
    assert all(identifier.startswith("pic-") for identifier in identifiers)
    references = re.findall(r'(?:href="#|url\(#)([^")]+)', result)
    assert len(references) > 5
    assert set(references) <= set(identifiers)


def test_drawing_is_unchanged(text: str) -> None:
    paths = re.compile(r'\bd="([^"]+)"')
    assert paths.findall(inline(text, "pic")) == paths.findall(text)


def test_other_text_is_refused() -> None:
    with pytest.raises(ValueError, match="no <svg> element"):
        inline("<p>", "pic")
