"""Layout of charts: panels of a size in inches, the colour bar and the legend beside them."""

import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from .chart_isochrones import Span
from .chart_plane import COLOURS
from .nomenclature import axis_label


def panels(rows: int, columns: int, width: float, height: float, top: float = 0.35) -> list[Axes]:
    """Return axes on a new figure that leaves room for labels, title and colour bar.

    Parameters
    ----------
    rows, columns : int
        Number of axes below and beside each other; those in a column share x, those in a row share y.
    width, height : float
        Size of each, in inches.
    top : float
        Room above them, in inches.

    Returns
    -------
    list of Axes
        Row by row.
    """
    left, right, bottom, beside, above = 0.75, 0.75, 0.55, 0.3, 0.45
    whole = left + columns * width + (columns - 1) * beside + right
    high = bottom + rows * height + (rows - 1) * above + top
    figure = Figure(figsize=(whole, high))
    FigureCanvasAgg(figure)  # measures words with one renderer, where the plain canvas makes one for each
    grid = figure.add_gridspec(
        rows,
        columns,
        left=left / whole,
        right=1 - right / whole,
        bottom=bottom / high,
        top=1 - top / high,
        wspace=beside / width,
        hspace=above / height,
    )
    return list(grid.subplots(sharex="col", sharey="row", squeeze=False).flat)


def add_colour_bar(axes: list[Axes], span: Span | None, times: npt.NDArray[np.float64]) -> None:
    """Take room for a colour bar off the right of axes, pointed where there are times beyond its ends.

    Parameters
    ----------
    axes : list of Axes
        In a block.
    span : tuple of float, or None
        Its shortest and longest time; None for no colour bar.
    times : ndarray, any shape
        All times to failure shown.
    """
    if span is None:
        return
    figure = figure_of(axes[0])
    frame = Bbox.union([ax.get_window_extent() for ax in axes])
    width, height = frame.width / figure.dpi, frame.height / figure.dpi
    below, above = bool(((times > 0) & (times < span[0])).any()), bool((times > span[1]).any())
    figure.colorbar(
        ScalarMappable(LogNorm(*span), COLOURS),
        ax=axes,
        label=axis_label("time_to_failure"),
        fraction=0.2 / width,
        pad=0.12 / width,
        aspect=height / 0.15,
        extend={(True, True): "both", (True, False): "min", (False, True): "max"}.get((below, above), "neither"),
    )


def add_legend(ax: Axes, handles: list[Artist]) -> None:
    """Explain markers and unnamed regions above the right end of axes.

    Parameters
    ----------
    ax : Axes
        With its title, if any, at the left.
    handles : list of Artist
        What to explain, labelled; nothing is drawn for none.
    """
    if handles:
        ax.legend(
            handles=handles,
            loc="lower right",
            bbox_to_anchor=(1.0, 1.0),
            ncols=len(handles),
            frameon=False,
            fontsize=9,
            borderaxespad=0.1,
            handletextpad=0.4,
            columnspacing=1.0,
        )


def figure_of(ax: Axes) -> Figure:
    """Return the figure, not a part of it, to which axes belong.

    Parameters
    ----------
    ax : Axes
        On a figure.
    """
    figure = ax.get_figure(root=True)
    assert figure is not None
    return figure
