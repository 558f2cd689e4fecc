"""The person's console in a terminal: the question with its map, the answer by single keys; works over ssh."""

from __future__ import annotations

import argparse
import getpass
import sys
import time
from collections.abc import Sequence

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rich.console import Console
from rich.live import Live

from advise_ros.command_line import CommandParser
from advise_ros.config import ConsoleConfig
from advise_ros.console.board import newer
from advise_ros.console.keyboard import decode
from advise_ros.console.listener import GraphListener
from advise_ros.console.requests import RequestDispatcher
from advise_ros.console.screen import screen
from advise_ros.console.terminal_session import TerminalSession
from advise_ros.core.errors import AdviseError
from advise_ros.exits import INTERRUPTED, OK, fail
from advise_ros.ros import arguments
from advise_ros.ros.background import BackgroundSpin
from advise_ros.ros.run import exit_now
from advise_ros.ros.terminal import Terminal

POLL_S = 0.03
EPILOG = """examples:
  ./advise ask                                    the open question, as soon as there is one
  ./advise ask --ros-args -r __ns:=/drone1        of a learner in a namespace

keys:
  y, n                         the question's first or second answer, at once: "on purpose", "by accident"
  arrows (or h j k l)          this direction is right
  Shift + arrows (or H J K L)  this direction is wrong; o: all others are
  Enter send   s skip   u unsure   Backspace undo   t take an earlier answer back
  m these cells differ: arrows move, x marks those that go another way, Enter sends; s splits it by itself
  1-9 map   r how it was flown there   v where it is unsure, or what is likely to be kept out of   ? all keys   q leave
  Space HOLD   f fly the policy   T take off   G land   R record a demonstration   S stop it   D discard it

Next: when no question is left, T takes off and f flies what was learnt; `./advise answer` shows what was said.

exit code: 0 left, 2 wrong usage or no terminal; 130 interrupted"""


def main() -> None:
    exit_now(run(sys.argv[1:]))


def run(argv: Sequence[str]) -> int:
    """The command with its arguments; returns the exit code."""
    try:
        options = _parser().parse_args(arguments.without_ros(argv))
        terminal = Terminal()
    except AdviseError as problem:
        return fail(str(problem))
    rclpy.init(args=list(argv), signal_handler_options=SignalHandlerOptions.NO)
    node = Node('ask')
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    listener = GraphListener(node, ConsoleConfig.silence_s)
    session = TerminalSession(RequestDispatcher(node, listener), options.name)
    spin = BackgroundSpin(executor, 'ask')
    try:
        _run_session(node, listener, session, terminal)
        return OK
    except KeyboardInterrupt:
        return INTERRUPTED
    finally:
        terminal.restore()
        spin.stop(patience_s=1.0)
        rclpy.try_shutdown()


def _parser() -> argparse.ArgumentParser:
    parser = CommandParser(
        prog='ask', description=__doc__, epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('--name', default=getpass.getuser(), help='your name, kept with your answers (default %(default)s)')
    return parser


def _run_session(node: Node, listener: GraphListener, session: TerminalSession, terminal: Terminal) -> None:
    """Draw what changes, do what is typed, until the person leaves or the terminal is gone."""
    service, known, rest = node.resolve_service_name('advise/answer'), {'': 0}, b''
    with Live(console=Console(), screen=True, auto_refresh=False) as live:
        while not session.over:
            typed = terminal.read()
            if typed is None:
                return
            meant, rest = decode(rest + typed)
            for one in meant:
                session.key(one)
            news = newer(listener.board.sections, known)
            known.update({name: section.version for name, section in news.items()})
            session.hear(listener.board.sections)
            if session.poll() or meant or news:
                live.update(screen(listener.board.sections, session, service, node.get_namespace()), refresh=True)
            time.sleep(POLL_S)
