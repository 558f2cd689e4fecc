"""Import everything once, so that its bytecode is on disk before many processes start side by side.

Compiling only what is imported takes a third of the time of compiling all packages. The loops of core/site are compiled to
machine code by their first use, which is here: it takes half a minute that no user should wait for.
"""

import contextlib
import importlib
import pkgutil

import advise_ros

TOOLS = ('pytest', 'hypothesis', 'xdist', 'pytest_timeout', 'rosidl_runtime_py')

names = [module.name for module in pkgutil.walk_packages(advise_ros.__path__, 'advise_ros.')]
for name in (*names, *TOOLS):
    with contextlib.suppress(Exception):  # What cannot be imported is told by whoever needs it.
        importlib.import_module(name)

from advise_ros.core.grid.grid import Grid  # noqa: E402 - after all others, whose order the environment may depend on
from advise_ros.core.site import within_advise  # noqa: E402

within_advise.compile_loops(Grid(1.0, 3, 3, (0.0, 0.0), 5.0, (2, 6)))
