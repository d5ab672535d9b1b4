"""From the folder of a finished study to figures and a page that a certification engineer can read."""

from __future__ import annotations

from levelone.report.render import render_report

__all__ = ["render_report"]
