"""Layout of charts: axes on a page, and title, legend and colour bar beside them."""

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, Normalize
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.transforms import ScaledTranslation

from ..checks import brief
from .choices import SIZES, check_choice

Floats = npt.NDArray[np.float64]

_ROUNDING = 1e-9
_PICTURE = "loading program"
_PICTURE_WIDTH, _PICTURE_HEIGHT = 0.3, 2.2
"""Of the small picture of a loading program: in widths of the axes, and in heights of the words."""


def axes_for(ax: Axes | None, size: str) -> Axes:
    """Return the axes to draw in, new ones if there are none.

    Parameters
    ----------
    ax : Axes or None
        Given by a user.
    size : str
        Of a new figure, a key of `SIZES`.

    Raises
    ------
    TypeError, ValueError
        If one of them is something else.
    """
    check_choice("size", size, SIZES)
    if ax is None:
        return new_axes(size)[0]
    if not isinstance(ax, Axes):
        raise TypeError(f"ax must be a Matplotlib Axes or None; got {brief(ax)}")
    return ax


def new_axes(size: str, rows: int = 1, columns: int = 1, tall: float = 1.0) -> list[Axes]:
    """Return axes on a new figure, which keeps room for all that is drawn beside them.

    Parameters
    ----------
    size : str
        A key of `SIZES`. Several axes are spread over the page of a slide, and make a column wider.
    rows, columns : int
        Number of axes below and beside each other; those in a column share x, those in a row share y.
    tall : float
        Height of a column in that of one chart; a slide keeps its own.

    Returns
    -------
    list of Axes
        Row by row.
    """
    check_choice("size", size, SIZES)
    page = SIZES[size]
    width, height, text = page.width, page.height, page.text
    if size == "column":
        width, height = width * (1.0 if columns == 1 else 2.06), height * tall
    elif rows * columns > 2:
        text *= 0.75
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)  # measures words with one renderer, where the plain canvas makes one for each
    axes = list(figure.subplots(rows, columns, sharex="col", sharey="row", squeeze=False).flat)
    for ax in axes:
        ax.tick_params(which="both", labelsize=text)
        for words in (ax.xaxis.label, ax.yaxis.label):
            words.set_size(text)
    return axes


def text_size(ax: Axes) -> float:
    """Return the size of words on axes in points, which is that of the labels of the axes."""
    return float(ax.xaxis.label.get_fontsize())


def line_width(ax: Axes, points: float) -> float:
    """Return the width of a line that is so wide beside words of 10 points."""
    return points * text_size(ax) / 10.0


def settle(ax: Axes) -> None:
    """Put axes where the layout of their figure, if it has one, has them in the end."""
    figure = figure_of(ax)
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)


def add_colour_bar(
    axes: Sequence[Axes],
    norm: Normalize,
    colours: Colormap,
    label: str,
    values: Floats,
    ticks: Sequence[float] = (),
) -> None:
    """Take room for a colour bar off the right of axes.

    Parameters
    ----------
    axes : sequence of Axes
        In a block.
    norm : Normalize
        From values to colours.
    colours : Colormap
        The colours.
    label : str
        What they show.
    values : ndarray, any shape
        All that are shown: the bar is pointed where there are values beyond its ends.
    ticks : sequence of float
        Where to name values; by default as on an axis.
    """
    figure, text = figure_of(axes[0]), text_size(axes[0])
    edge = axes[-1].get_window_extent().x1
    bar = axes[0].figure.colorbar(
        ScalarMappable(norm, colours), ax=list(axes), extend=_extension(values, norm), pad=0.02, aspect=25
    )
    bar.ax.tick_params(which="both", labelsize=text)
    if ticks:
        bar.set_ticks(list(ticks), labels=[f"{tick:g}" for tick in ticks])
        bar.minorticks_off()
    bar.set_label(label, fontsize=text)
    if figure.get_layout_engine() is None:
        box = bar.ax.get_tightbbox()
        assert box is not None
        over = box.x1 - edge
        for ax in axes:
            shrink(ax, right=over)
        x0, y0, width, height = bar.ax.get_position().bounds
        bar.ax.set_position((x0 - over / axes[0].figure.bbox.width, y0, width, height))


def add_heading(
    ax: Axes,
    title: Sequence[str],
    handles: Sequence[Artist] = (),
    heading: str = "",
    course: tuple[Floats, Floats] | None = None,
) -> None:
    """Write title and legend above axes, and settle the layout.

    Parameters
    ----------
    ax : Axes
        With its labels, and colour bar if any.
    title : sequence of str
        Parts of the title, set into as many lines as they need.
    handles : sequence of Artist
        For a legend.
    heading : str
        What the legend is about.
    course : tuple of ndarray, optional
        Times and fields of a small picture of the loading program, beside the title.
    """
    settle(ax)
    width = ax.get_window_extent().width
    _write_heading(ax, title, handles, heading, course)
    if figure_of(ax).get_layout_engine() is not None and ax.get_window_extent().width < width - 1.0:
        _write_heading(ax, title, handles, heading, course)  # other numbers at the ticks have made it narrower


def _write_heading(
    ax: Axes, title: Sequence[str], handles: Sequence[Artist], heading: str, course: tuple[Floats, Floats] | None
) -> None:
    text = text_size(ax)
    for child in [child for child in ax.child_axes if child.get_label() == _PICTURE]:
        child.remove()
    inches = _height_of_ticks(ax)
    if handles:
        high = _legend(ax, handles, heading, inches).get_window_extent().height
        inches += high / figure_of(ax).dpi
    if figure_of(ax).get_layout_engine() is None:
        shrink(ax, top=inches * figure_of(ax).dpi)
    room = ax.get_window_extent().width * (1.0 - (_PICTURE_WIDTH if course is not None else 0.0))
    ax.set_title(
        "\n".join(_in_lines(ax, title, room)), loc="left", fontsize=text, y=1.0, pad=72.0 * inches + 0.5 * text
    )
    if course is not None:
        _draw_program(ax, inches, course)
    settle(ax)


def _in_lines(ax: Axes, title: Sequence[str], room: float) -> list[str]:
    """Return the parts of a title in lines that are no wider; a part is broken only where it is wider itself."""

    def fits(words: str) -> bool:
        trial = ax.text(0.0, 0.0, words, fontsize=text_size(ax))
        width = trial.get_window_extent().width
        trial.remove()
        return bool(width <= room)

    lines = [""]
    for part in title:
        gap = ", "
        for words in [part] if fits(part) else part.split():
            longer = f"{lines[-1]}{gap}{words}" if lines[-1] else words
            if fits(longer) or not lines[-1]:
                lines[-1] = longer
            else:
                lines[-1] += gap.rstrip()
                lines.append(words)
            gap = " "
    return lines


def _draw_program(ax: Axes, inches: float, course: tuple[Floats, Floats]) -> None:
    """Draw field against time, small, right of the title, so high above axes."""
    text = text_size(ax)
    place = ax.transAxes + ScaledTranslation(0.0, inches + 0.5 * text / 72.0, figure_of(ax).dpi_scale_trans)
    high = _PICTURE_HEIGHT * text * figure_of(ax).dpi / 72.0 / ax.get_window_extent().height
    bounds = (1.08 - _PICTURE_WIDTH, 1.0, _PICTURE_WIDTH - 0.1, high)
    picture = ax.inset_axes(bounds, transform=place, label=_PICTURE)
    time, field = course
    picture.plot(time, field, color="black", linewidth=line_width(ax, 1.0), clip_on=False)
    picture.axhline(0.0, color="0.6", linewidth=line_width(ax, 0.6), zorder=0.5)
    picture.set(xticks=[], yticks=[], xlim=(time[0], time[-1]))
    picture.spines[:].set_visible(False)
    look: dict[str, Any] = {"fontsize": 0.8 * text, "transform": picture.transAxes}
    picture.text(-0.04, 0.5, "$E$", ha="right", va="center", **look)
    picture.text(1.04, 0.0, "$t$", ha="left", va="center", **look)


def figure_of(ax: Axes) -> Figure:
    """Return the figure, not a part of it, to which axes belong.

    Parameters
    ----------
    ax : Axes
        On a figure.
    """
    return ax.figure.canvas.figure


def shrink(ax: Axes, right: float = 0.0, top: float = 0.0) -> None:
    """Take room off axes at the right and the top.

    Parameters
    ----------
    ax : Axes
        Whose figure has no layout of its own.
    right, top : float
        In pixels.
    """
    page = ax.figure.bbox
    x0, y0, width, height = ax.get_position().bounds
    ax.set_position((x0, y0, width - right / page.width, height - top / page.height))


def _height_of_ticks(ax: Axes) -> float:
    """Return how far the words of a second axis reach above axes, in inches."""
    boxes = [child.get_tightbbox() for child in ax.child_axes]
    top = ax.get_window_extent().y1
    reach = max((box.y1 for box in boxes if box is not None), default=top) - top
    return float(reach) / figure_of(ax).dpi


def _legend(ax: Axes, handles: Sequence[Artist], heading: str, inches: float) -> Legend:
    """Draw a legend above axes, so high, in as few rows as fit."""
    text, width = text_size(ax), ax.get_window_extent().width
    place = ax.transAxes + ScaledTranslation(0.0, inches, figure_of(ax).dpi_scale_trans)
    for rows in range(1, len(handles) + 1):
        legend = ax.legend(
            handles=handles,
            title=heading or None,
            ncols=-(-len(handles) // rows),
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            bbox_transform=place,
            alignment="left",
            frameon=False,
            fontsize=0.9 * text,
            title_fontsize=0.9 * text,
            borderpad=0.1,
            borderaxespad=0.2,
            handletextpad=0.4,
            columnspacing=1.0,
        )
        if legend.get_window_extent().width <= width:
            break
    return legend


def _extension(values: Floats, norm: Normalize) -> Literal["neither", "both", "min", "max"]:
    """Return at which ends of a scale there are values beyond it, in the words of Matplotlib."""
    scaled = np.asarray(norm(values))
    below, above = bool((scaled < -_ROUNDING).any()), bool((scaled > 1.0 + _ROUNDING).any())
    if below:
        return "both" if above else "min"
    return "max" if above else "neither"
