"""Figures in the manner of a paper: one panel a domain, means with their 95 % intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from advise_ros.core.errors import InputError
from advise_ros.domains.domain import Measure
from advise_ros.experiments.figures import QualityRow, Row5, Row6

BLUE = '#0072B2'
# Okabe and Ito's colours, told apart by colour-blind readers; marker and line tell the methods apart in print.
STYLES: dict[str, dict[str, Any]] = {
    'clustered': {'color': BLUE, 'marker': 'o', 'label': 'Clustered Advice'},
    'single': {'color': '#D55E00', 'marker': 's', 'label': 'Single Advice'},
    'random': {'color': '#009E73', 'marker': '^', 'label': 'Random Advice'},
    'trajectories': {'color': '#555555', 'marker': '', 'linestyle': '--', 'label': 'Only Trajectories'},
    'ideal': {'color': '#CC79A7', 'marker': 'd', 'linestyle': ':', 'label': 'Ideal Clusters'},
    'shuffled': {'color': '#56B4E9', 'marker': 'v', 'linestyle': '-.', 'label': 'Clusters in Random Order'},
}
STYLE: Any = {
    'font.family': 'serif', 'font.size': 8, 'axes.titlesize': 9, 'axes.linewidth': 0.6, 'lines.linewidth': 1.2,
    'lines.markersize': 3.5, 'legend.frameon': False, 'axes.spines.top': False, 'axes.spines.right': False,
    'svg.hashsalt': 'advise_ros', 'svg.fonttype': 'path', 'mathtext.fontset': 'dejavuserif',
}
PANEL_IN = (3.2, 2.3)
DOTS_PER_INCH = 200
# Of an axis in per cent.
SHARES = (-5.0, 105.0)


def title(domain: str) -> str:
    """A domain's name as a heading; a user's stays as it is."""
    return {'wumpus': 'Wumpus World', 'sailing': 'Sailing', 'traffic': 'Traffic', 'drone': 'Drone'}.get(domain, domain)


def figure5(rows: Sequence[Row5], measures: Mapping[str, str]) -> Figure:
    """Performance against the number of questions; `measures` are the labels of the domains' vertical axes."""
    domains = list(dict.fromkeys(row.domain for row in rows))
    figure, panels = in_panels(len(domains))
    for name, axes in zip(domains, panels, strict=True):
        _curves(axes, [row for row in rows if row.domain == name])
        axes.set(title=title(name), xlabel='number of questions', ylabel=measures[name])
        if measures[name] == Measure.GOAL.value:
            low, high = axes.get_ylim()  # Intervals of few trials reach far beyond what a share can be.
            axes.set_ylim(max(low, SHARES[0]), min(high, SHARES[1]))
    handles, labels = _legend(panels)
    figure.legend(
        handles, labels, loc='outside lower center', ncols=3 if len(panels) > 1 else 2, columnspacing=1.0, handletextpad=0.5,
        borderpad=0.2,
    )
    return figure


def _curves(axes: Axes, rows: Sequence[Row5]) -> None:
    for method in dict.fromkeys(row.method for row in rows):
        mine = [row for row in rows if row.method == method]
        queries, means = [row.queries for row in mine], [row.mean for row in mine]
        style = STYLES.get(method, {'label': method, 'marker': '.'})
        axes.plot(queries, means, **style)
        axes.fill_between(
            queries, [row.mean - row.ci95 for row in mine], [row.mean + row.ci95 for row in mine],
            color=style.get('color'), alpha=0.15, linewidth=0,
        )


def figure6(rows: Sequence[Row6]) -> Figure:
    """Performance relative to ideal clusters against their quality."""
    domains = list(dict.fromkeys(row.domain for row in rows))
    figure, panels = in_panels(len(domains))
    for name, axes in zip(domains, panels, strict=True):
        mine = [row for row in rows if row.domain == name]
        axes.errorbar(
            [100.0 * row.quality for row in mine], [row.mean for row in mine], [row.ci95 for row in mine],
            color=BLUE, marker='o', capsize=2,
        )
        axes.set(title=title(name), xlabel='cluster quality [%]', ylabel='performance relative to ideal', ylim=(0.0, 1.1))
        axes.invert_xaxis()
    return figure


def clusters(rows: Sequence[QualityRow]) -> Figure:
    """Quality of the clusters beside the paper's."""
    figure, (axes,) = in_panels(1)
    places = range(len(rows))
    axes.bar(places, [row.mean for row in rows], 0.5, yerr=[row.ci95 for row in rows], color=BLUE, capsize=3, label='here')
    told = [(place, row.paper) for place, row in zip(places, rows, strict=True) if row.paper is not None]
    axes.plot([place for place, _ in told], [paper for _, paper in told], 'D', color='#D55E00', label="the paper's")
    axes.hlines(
        [row.least for row in rows], [place - 0.3 for place in places], [place + 0.3 for place in places],
        colors='#555555', linestyles=':', label='least possible',
    )
    names = [title(row.domain).replace(' ', '\n') for row in rows]
    axes.set(xticks=list(places), xticklabels=names, ylabel='cluster quality [%]', ylim=(0, 105))
    figure.legend(loc='outside lower center', ncols=3)
    return figure


def in_panels(number: int) -> tuple[Figure, list[Axes]]:
    """A figure with so many panels, at most two in a row."""
    columns = min(number, 2)
    lines = -(-number // columns)
    figure = Figure(figsize=(PANEL_IN[0] * columns, PANEL_IN[1] * lines + 0.4), layout='constrained')
    panels = list(figure.subplots(lines, columns, squeeze=False).flat)
    for unused in panels[number:]:
        unused.remove()
    return figure, panels[:number]


def _legend(panels: Sequence[Axes]) -> tuple[list[Any], list[str]]:
    """Each label once."""
    found = {label: handle for axes in panels for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    return list(found.values()), list(found)


def save(figure: Figure, stem: Path, suffixes: Sequence[str] = ('.png', '.svg')) -> list[Path]:
    """As PNG and SVG, or one of them; the same figure gives the same bytes. Returns the files.

    Raises:
        InputError: the directory cannot be written.
    """
    paths = [stem.with_suffix(suffix) for suffix in suffixes]
    try:
        for path in paths:
            as_png = {'dpi': DOTS_PER_INCH, 'metadata': {'Software': None}}
            figure.savefig(path, **(as_png if path.suffix == '.png' else {'metadata': {'Date': None}}))
    except OSError as problem:
        raise InputError(f'{stem} cannot be written ({problem.strerror}); name another directory') from problem
    return paths


def in_style() -> Any:
    """A context in which figures are drawn."""
    return mpl.rc_context(STYLE)
