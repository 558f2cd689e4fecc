"""The report page of a session: one HTML file that holds everything."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import jinja2


def render(values: Mapping[str, Any]) -> str:
    """The page; what people wrote is escaped, a missing value is an error."""
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=False)
    template = environment.from_string(files('advise_ros.report').joinpath('page.html').read_text(encoding='utf-8'))
    return template.render(values)


def write(directory: Path, values: Mapping[str, Any]) -> Path:
    """Write report.html, and each picture as a file of its own beside it; returns the page's path."""
    for name, picture in values.items():
        if name.endswith('_svg'):
            (directory / f'{name.removesuffix("_svg")}.svg').write_text(picture, encoding='utf-8')
    path = directory / 'report.html'
    path.write_text(render(values), encoding='utf-8')
    return path
