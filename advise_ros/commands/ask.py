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
from advise_ros.console.keyboard import decode, help_text
from advise_ros.console.language import ENGLISH, languages, of_terminal, words
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
  ./advise ask --language de                      in German
  ./advise ask --ros-args -r __ns:=/drone1        of a learner in a namespace

keys (the same list as ? shows):
{keys}

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
    session = TerminalSession(RequestDispatcher(node, listener), options.name, words(options.language or of_terminal()))
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
        prog='ask', description=__doc__, epilog=EPILOG.format(keys=help_text(words(ENGLISH))),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('--name', default=getpass.getuser(), help='your name, kept with your answers (default %(default)s)')
    parser.add_argument('--language', choices=languages(), help='language of the screen (default: that of LANG)')
    return parser


def _run_session(node: Node, listener: GraphListener, session: TerminalSession, terminal: Terminal) -> None:
    """Draw what changes, do what is typed, until the person leaves or the terminal is gone."""
    service, known, rest = node.resolve_service_name('advise/answer'), {'': 0}, b''
    console = Console()
    with Live(console=console, screen=True, auto_refresh=False) as live:
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
                view = screen(listener.board.sections, session, service, node.get_namespace(), console.size)
                live.update(view, refresh=True)
            time.sleep(POLL_S)
