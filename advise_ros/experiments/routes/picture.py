"""Success against the number of answers, a panel a size of site."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from advise_ros.core.statistics import wilson
from advise_ros.experiments.figures import Trials
from advise_ros.experiments.plots import BLUE, SHARES, in_panels
from advise_ros.experiments.routes.tables import RouteTable, seeds_of
from advise_ros.experiments.routes.work import outcomes
from advise_ros.experiments.store import Store

STYLES: dict[str, dict[str, Any]] = {
    'site': {'color': BLUE, 'marker': 'o', 'label': 'site (this learner)'},
    'occupancy': {'color': '#D55E00', 'marker': 's', 'label': 'occupancy (before)'},
    'paper': {'color': '#CC79A7', 'marker': 'd', 'label': 'paper'},
    'maxent': {'color': '#009E73', 'linestyle': '-.', 'label': 'maximum causal entropy'},
    'cloning': {'color': '#56B4E9', 'linestyle': ':', 'label': 'cloning'},
    'planner': {'color': '#555555', 'linestyle': '--', 'label': 'planner'},
}


# Intervals of all would hide one another; the tables have them.
SHADED = 'site'


def picture(table: RouteTable, store: Store, trials: Trials, most: int) -> Figure:
    """Per cent of the trials that succeed after 0 to `most` answers, with Wilson's 95 % interval of the learner."""
    figure, axes = in_panels(len(table.lines))
    for (label, case), axis in zip(table.lines, axes, strict=True):
        for way in table.ways_of(case):
            curves = [one['curve'] for one in outcomes(store, case, way, seeds_of(case, trials))]
            if curves:
                hits = [[curve[min(at, len(curve) - 1)] for curve in curves] for at in range(most + 1)]
                _curve(axis, hits, STYLES[way], shaded=way == SHADED)
        axis.set(title=label, xlabel='answers', ylabel='routes flown as wished [%]', ylim=SHARES)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc='outside lower center', ncols=3 if len(axes) > 1 else 2)
    return figure


def _curve(axis: Axes, at: list[list[bool]], style: dict[str, Any], *, shaded: bool) -> None:
    answers = np.arange(len(at))
    axis.plot(answers, [100.0 * np.mean(hits) for hits in at], **style)
    if shaded:
        low, high = np.array([wilson(sum(hits), len(hits)) for hits in at]).T
        axis.fill_between(answers, 100.0 * low, 100.0 * high, color=style['color'], alpha=0.15, linewidth=0)
