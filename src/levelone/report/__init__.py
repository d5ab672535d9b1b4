"""From the folder of a finished study to figures and a page for engineers; ``render_report`` is imported on first use."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from levelone.report.render import render_report as render_report

__all__ = ["render_report"]


def __getattr__(name: str) -> Any:
    if name != "render_report":
        raise AttributeError(f"module 'levelone.report' has no attribute {name!r}")
    from levelone.report.render import render_report

    globals()[name] = render_report
    return render_report
