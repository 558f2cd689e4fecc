"""Start, spin and stop a node: what every executable of the package shares."""

from __future__ import annotations

import difflib
import inspect
import os
import re
import signal
import sys
import textwrap
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from advise_ros import config
from advise_ros.core.errors import AdviseError
from advise_ros.exits import OK, fail
from advise_ros.ros import arguments, introspection, parameters
from advise_ros.ros.configured import ConfiguredNode


def help_text(name: str, doc: str, config_class: type[Any]) -> str:
    """The text of --help: what the node does, its parameters and how to start it."""
    usage = f'usage: ros2 run advise_ros {name} [--ros-args -p NAME:=VALUE ... -r FROM:=TO ...]'
    lines = [usage, '', inspect.cleandoc(doc), '', 'parameters:']
    for spec in fields(config_class):
        lines.append(f'  {spec.name}  (default {spec.default!r}; {config.range_text(spec)})')
        lines.extend(textwrap.wrap(spec.metadata['doc'], 92, initial_indent='      ', subsequent_indent='      '))
    states = ', '.join(introspection.STATES)
    lines.append(f"  {introspection.PARAMETER}  (default 'off'; {states})")
    lines.extend(textwrap.wrap(introspection.DESCRIPTION, 92, initial_indent='      ', subsequent_indent='      '))
    lines += ['', 'Without the ros2 command: ./advise ' + name + ' [the same arguments]']
    return '\n'.join(lines)


def run_node(node_class: type[Node], config_class: type[Any], argv: Sequence[str] | None = None) -> int:
    """Run one node in its own SingleThreadedExecutor until SIGINT, SIGTERM or its own shutdown.

    The node class takes no argument, reads its config with `load` (ConfiguredNode), raises AdviseError for
    what the user can put right, and may have an `exit_code` attribute and a `close()` method (called once
    after spinning; the ROS context may be gone by then). A node ends itself by `rclpy.try_shutdown()`.

    Returns:
        0 after a clean stop, 2 on wrong parameters or input, or the node's `exit_code`.
    """
    args = list(sys.argv[1:] if argv is None else argv)
    name = node_class.__module__.rsplit('.', 1)[-1]
    if '--help' in args or '-h' in args:
        print(help_text(name, node_class.__doc__ or '', config_class))
        return OK
    try:
        rest = arguments.without_ros(args)
    except AdviseError as problem:
        return fail(str(problem))
    if rest:
        return fail(f'{name} takes ROS arguments only, not {rest[0]!r}; {meant_parameter(args, config_class)} (see --help)')
    parameters.read_files(args)
    return _spin(node_class) if _joined(args) else OK


def meant_parameter(args: Sequence[str], config_class: type[Any]) -> str:
    """The form of the parameter that somebody likely meant whose command line is not ROS's."""
    words = [re.split(r':?=', word.lstrip('-'))[0].replace('-', '_') for word in args if word != '--ros-args']
    known = [spec.name for spec in fields(config_class)]
    near = [found[0] for word in words if word and (found := difflib.get_close_matches(word, known, n=1))]
    return f'did you mean --ros-args -p {near[0]}:=VALUE?' if near else 'parameters go as --ros-args -p NAME:=VALUE'


def _joined(args: list[str]) -> bool:
    """Start ROS, which takes care of signals from then on; False when SIGTERM came first.

    rclpy calls the handler that it found as well: one that leaves a note and does nothing else.
    """
    terminated: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: terminated.append(number))
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.ALL)
    return not terminated


def _spin(node_class: type[Node]) -> int:
    node = None
    code = OK
    try:
        node = node_class()
        introspection.configure(node)
        if isinstance(node, ConfiguredNode) and not node.unconfigured:
            node.check_overrides()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        executor.spin()
    except (ExternalShutdownException, KeyboardInterrupt):
        pass
    except Exception as problem:
        if rclpy.ok():  # Else a signal ended the context in the middle of something: a clean stop.
            if not isinstance(problem, AdviseError):
                raise
            code = fail(str(problem))
    finally:
        if node is not None:
            close = getattr(node, 'close', None)
            if close is not None:
                close()
            code = code or int(getattr(node, 'exit_code', OK))
            node.destroy_node()
        _shut_down()
    return code


def _shut_down() -> None:
    """End the context; rclpy's thread for signals may do so in the same moment, which is no failure."""
    try:
        rclpy.try_shutdown()
    except RuntimeError:
        if rclpy.ok():
            raise


def exit_now(code: int) -> None:
    """Leave the process without waiting for stray threads of the middleware."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
