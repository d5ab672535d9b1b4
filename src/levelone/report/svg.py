"""SVG files made ready to stand inside a page."""

from __future__ import annotations

import re

_DROPPED = re.compile(r"<!--.*?-->|<metadata>.*?</metadata>|<defs>\s*<style[^>]*>.*?</style>\s*</defs>|\s*\n\s*(?=<)", re.DOTALL)
_OPENING = re.compile(r"<svg\b[^>]*>")
_IDENTIFIER = re.compile(r'(\bid="|href="#|url\(#)')


def inline(text: str, name: str) -> str:
    """The ``<svg>`` element of a file, for HTML.

    Without prologue, comments, metadata, page-wide styles and namespaces (HTML knows them), with a ``viewBox`` and no
    fixed size, and with every identifier prefixed by ``name``: several pictures share one page.
    """
    opening = _OPENING.search(text)
    if opening is None:
        raise ValueError(f"{name}: no <svg> element")
    box = re.search(r'viewBox="[^"]*"', opening[0])
    body = _DROPPED.sub("", text[opening.end() :]).replace("xlink:href=", "href=")
    return f"<svg {box[0] if box else ''}>" + _IDENTIFIER.sub(rf"\g<1>{name}-", body).strip()
