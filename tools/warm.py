"""Import everything once, so that its bytecode is on disk before many processes start side by side.

That includes what functions import when they need it: scikit-learn alone takes six seconds to compile, in each process that
finds no bytecode of it. Compiling only what is imported takes a third of the time of compiling all packages. The loops of
core/site are compiled to machine code by their first use, which is here: it takes half a minute that no user should wait for.
"""

import ast
import contextlib
import importlib
import pkgutil
from collections.abc import Iterator
from pathlib import Path

import advise_ros

TOOLS = ('pytest', 'hypothesis', 'xdist', 'pytest_timeout', 'pytest_rerunfailures', 'playwright.sync_api', 'rosidl_runtime_py')


def imported_late() -> Iterator[str]:
    """Modules that functions of the package import: `from a import b` may mean a module b, too."""
    for path in sorted(Path(advise_ros.__path__[0]).rglob('*.py')):
        for node in ast.walk(ast.parse(path.read_bytes())):
            if isinstance(node, ast.Import):
                yield from (name.name for name in node.names)
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                yield node.module
                yield from (f'{node.module}.{name.name}' for name in node.names)


names = [module.name for module in pkgutil.walk_packages(advise_ros.__path__, 'advise_ros.')]
for name in dict.fromkeys((*names, *imported_late(), *TOOLS)):
    with contextlib.suppress(Exception):  # What cannot be imported is told by whoever needs it.
        importlib.import_module(name)

from advise_ros.core.grid.grid import Grid  # noqa: E402 - after all others, whose order the environment may depend on
from advise_ros.core.site import within_advise  # noqa: E402

within_advise.compile_loops(Grid(1.0, 3, 3, (0.0, 0.0), 5.0, (2, 6)))
