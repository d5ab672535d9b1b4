"""One look for all figures, and files that are the same, byte for byte, whenever they are drawn."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from io import BytesIO
from typing import Any, Literal

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg, RendererAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.mathtext import MathTextParser
from matplotlib.transforms import blended_transform_factory
from numpy.typing import NDArray

COLUMN = 3.45
"""in: width of a figure that fills one column of a journal."""
PAGE = 7.0
"""in: width of a figure across both columns."""
PNG_DPI = 150

# Okabe and Ito: told apart under every common form of colour blindness, and in grey by their lightness.
BLACK, GREY, FAINT = "#000000", "#6e6e6e", "#b5b5b5"
BLUE, ORANGE, GREEN, VERMILLION, PURPLE = "#0072b2", "#e69f00", "#009e73", "#d55e00", "#9a4f7f"
LEVEL_COLOURS = ("#dcefe8", "#fbf1cf", "#f7dccb")
"""Regions of Level 1, 2 and 3: tints of green, yellow and vermillion."""

PAPER: Any = {
    "font.family": "serif",
    "font.serif": ["STIXGeneral"],
    "mathtext.fontset": "stix",
    "font.size": 8.5,
    "axes.titlesize": 8.5,
    "axes.labelsize": 8.5,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "legend.handlelength": 1.8,
    "legend.borderaxespad": 0.2,
    "legend.columnspacing": 1.2,
    "legend.labelspacing": 0.25,
    "axes.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.labelpad": 1.5,
    "axes.titlepad": 4.0,
    "axes.unicode_minus": True,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4,
    "ytick.minor.width": 0.4,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "xtick.minor.size": 1.5,
    "ytick.minor.size": 1.5,
    "lines.linewidth": 1.0,
    "hatch.linewidth": 0.4,
    "hatch.color": FAINT,
    "path.simplify": True,
    "path.simplify_threshold": 0.2,
    "svg.fonttype": "path",
    "svg.hashsalt": "levelone",
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "savefig.bbox": None,
}


@cache
def _parser() -> MathTextParser:
    """Each renderer would have one of its own and read every symbol anew, half of the time of a small figure."""
    return RendererAgg(1, 1, PNG_DPI).mathtext_parser


@contextmanager
def paper() -> Iterator[None]:
    """Draw and save figures inside this, so that neither the user's settings nor their style files show."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(PAPER)
        yield


@dataclass(frozen=True)
class Margins:
    """Room around and between the axes of a figure, in.

    Fixed by the author and not by an automatic layout: frames of one kind have one size, and nothing is drawn twice.
    """

    left: float = 0.5
    right: float = 0.1
    bottom: float = 0.38
    top: float = 0.12
    between: float = 0.12
    beside: float = 0.55


def sheet(
    width: float, height: float, rows: int = 1, columns: int = 1, *, margins: Margins = Margins(), **options: Any
) -> tuple[Figure, NDArray[Any]]:
    """A figure (in) with a grid of axes ``[rows, columns]``; ``options`` go to ``Figure.subplots``."""
    figure = Figure(figsize=(width, height), dpi=PNG_DPI)
    FigureCanvasAgg(figure)
    across = (width - margins.left - margins.right - (columns - 1) * margins.beside) / columns
    down = (height - margins.bottom - margins.top - (rows - 1) * margins.between) / rows
    figure.subplots_adjust(
        left=margins.left / width,
        right=1.0 - margins.right / width,
        bottom=margins.bottom / height,
        top=1.0 - margins.top / height,
        wspace=margins.beside / across,
        hspace=margins.between / down,
    )
    axes = figure.subplots(rows, columns, squeeze=False, **options)
    for panel in axes.flat:  # labels of all panels in one line, without measuring every tick label
        panel.yaxis.set_label_coords(-(margins.left - 0.18) / across, 0.5)
        foot = blended_transform_factory(panel.transAxes, figure.dpi_scale_trans)
        panel.xaxis.set_label_coords(0.5, margins.bottom - 0.18, transform=foot)
    return figure, axes


def renderer(figure: Figure) -> RendererAgg:
    """What draws the figure in dots; all figures read their symbols through one parser, which remembers them."""
    return _canvas(figure).get_renderer()


def _canvas(figure: Figure) -> FigureCanvasAgg:
    canvas = figure.canvas if isinstance(figure.canvas, FigureCanvasAgg) else FigureCanvasAgg(figure)
    canvas.get_renderer().mathtext_parser = _parser()
    return canvas


def png_of(figure: Figure) -> bytes:
    """A picture of dots, without date or version.

    The canvas is asked itself: ``Figure.savefig`` draws everything twice.
    """
    figure.set_dpi(PNG_DPI)  # print_svg leaves its own
    out = BytesIO()
    _canvas(figure).print_png(out, metadata={"Software": None})
    return out.getvalue()


def svg_of(figure: Figure) -> bytes:
    """A picture of lines, without date or version. Symbols are kept between calls: write SVG after SVG."""
    out = BytesIO()
    FigureCanvasSVG(figure).print_svg(out, metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    return out.getvalue()


def grid(axes: Axes, axis: Literal["both", "x", "y"] = "both") -> None:
    """Thin lines that guide the eye and stay behind the data."""
    axes.grid(True, which="major", axis=axis, color="#e3e3e3", linewidth=0.4)


def note(figure: Figure, lines: Sequence[str]) -> None:
    """Small print along the lower edge."""
    width, height = figure.get_size_inches()
    figure.text(0.06 / width, 0.04 / height, "\n".join(lines), ha="left", va="bottom", fontsize=6.8, color=GREY, linespacing=1.15)


def key(figure: Figure, handles: Sequence[Any], *, columns: int) -> None:
    """One legend along the upper edge, away from the data."""
    figure.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, 1.0), ncols=columns)
