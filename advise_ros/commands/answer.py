"""Answer the learner's questions from the terminal; without arguments, show the open one."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import replace

import rclpy
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import Trigger

from advise_msgs.msg import LearnerStatus
from advise_msgs.srv import AnswerQuery, PreviewAnswer, RetractAdvice
from advise_ros.command_line import CommandParser
from advise_ros.commands.question_text import log_text, question_text
from advise_ros.core.advice.advice import Answer, AnswerOption, Verdict
from advise_ros.core.errors import AdviseError, InputError
from advise_ros.core.grid.grid import Action
from advise_ros.exits import INTERRUPTED, OK, VERDICT_NO, fail
from advise_ros.ros import arguments, convert, convert_advice
from advise_ros.ros.graph_client import GraphClient, GraphTimeoutError

ACCEPTED, REFUSED = OK, VERDICT_NO
EPILOG = """examples:
  ./advise answer                                            show the open question and the answers so far
  ./advise answer --query 3 --say on-purpose                 or by-accident: one of the words that the question offers
  ./advise answer --query 3 --prefer east --avoid north,west
  ./advise answer --query 3 --prefer east --avoid west --preview     what it would change
  ./advise answer --query 3 --skip                           or --unsure, or --mixed: the cells need different actions
  ./advise answer --undo                                     take the last answer back
  ./advise answer --retract 2                                take answer 2 back
A learner in a namespace: add --ros-args -r __ns:=/NAMESPACE

Next: show the next question by the same command without arguments; when none is left, fly the policy:
  ros2 action send_goal --feedback policy/fly advise_msgs/action/Fly "{start_cell: -1}"     (or f in ./advise ask)

exit code: 0 accepted (or shown), 1 refused, 2 wrong usage or no learner there; 130 interrupted"""


def main() -> None:
    sys.exit(run(sys.argv[1:]))


def run(argv: Sequence[str]) -> int:
    """The command with its arguments; returns the exit code."""
    try:
        options = _parser().parse_args(arguments.without_ros(argv))
        said = _answer(options)
        rclpy.init(args=list(argv), signal_handler_options=SignalHandlerOptions.NO)
        client = GraphClient('answer')
        try:
            return _act(client, options, said)
        finally:
            client.close()
    except GraphTimeoutError as problem:
        return fail(f'{problem}; is the learner (./advise advise) running, in this ROS domain and namespace?')
    except AdviseError as problem:
        return fail(str(problem))
    except KeyboardInterrupt:
        return INTERRUPTED


def _parser() -> argparse.ArgumentParser:
    parser = CommandParser(
        prog='answer', description=__doc__, epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('--query', type=int, metavar='ID', help='the query that is answered')
    parser.add_argument('--say', metavar='WORD', help='the answer in one of the words that the question offers')
    parser.add_argument('--prefer', metavar='ACTIONS', help='right actions: north, east, south, west, joined by commas')
    parser.add_argument('--avoid', metavar='ACTIONS', help='wrong actions')
    what = parser.add_mutually_exclusive_group()
    what.add_argument('--skip', action='store_const', dest='verdict', const=Verdict.SKIP, help='rather not answer this one')
    what.add_argument('--unsure', action='store_const', dest='verdict', const=Verdict.UNSURE, help="don't know")
    what.add_argument('--mixed', action='store_const', dest='verdict', const=Verdict.MIXED, help='not one action for all')
    what.add_argument('--undo', action='store_true', help='take the last answer back')
    what.add_argument('--retract', type=int, metavar='ID', help='take this earlier answer back')
    parser.add_argument('--preview', action='store_true', help='only show what the answer would change')
    parser.add_argument('--expert', default='', metavar='NAME', help='who says so')
    parser.add_argument('--comment', default='', metavar='TEXT', help='kept with the answer')
    parser.add_argument('--wait', type=float, default=5.0, metavar='S', help='longest wait for the learner (default 5)')
    return parser


def _answer(options: argparse.Namespace) -> Answer | None:
    """The answer that the options spell, None when they spell none.

    Raises:
        InputError: they do not fit together.
    """
    if not 0 < options.wait < math.inf:
        raise InputError(f'--wait is {options.wait:g}; it must be a number of seconds above 0')
    sets = options.prefer is not None or options.avoid is not None
    if not sets and options.verdict is None and options.say is None:
        if options.query is not None and not options.undo and options.retract is None:
            raise InputError(f'query {options.query} needs an answer: --say, --prefer and --avoid, --skip, --unsure or --mixed')
        return None
    others = options.verdict is not None or options.undo or options.retract is not None
    if (sets and others) or (options.say is not None and (sets or others)):
        name = '--say is an answer of its' if options.say is not None else '--prefer and --avoid are an answer of their'
        raise InputError(f'{name} own; drop the other one')
    if options.query is None:
        raise InputError('say which query is answered by --query ID; without arguments the open one is shown')
    if not 0 < options.query < 2**64:
        raise InputError(f'--query is {options.query}; query ids count up from 1')
    verdict = Verdict.ANSWER if options.verdict is None else options.verdict
    preferred, avoided = _actions(options.prefer), _actions(options.avoid)
    return Answer(options.query, verdict, preferred, avoided, options.expert, options.comment)


def _actions(words: str | None) -> tuple[int, ...]:
    return tuple(_action(word.strip()) for word in (words or '').split(',') if word.strip())


def _action(word: str) -> int:
    for action in Action:
        if word.lower() in (action.name.lower(), action.name[0].lower(), str(int(action))):
            return int(action)
    raise InputError(f"action '{word}' is unknown; actions: {', '.join(action.name.lower() for action in Action)}")


def _act(client: GraphClient, options: argparse.Namespace, said: Answer | None) -> int:
    if options.undo:
        return _print_reply(client.call(Trigger, 'advise/undo', Trigger.Request(), options.wait))
    if options.retract is not None:
        if not 0 < options.retract < 2**64:
            raise InputError(f'--retract is {options.retract}; answer ids count up from 1')
        request = RetractAdvice.Request(advice_id=options.retract)
        return _print_reply(client.call(RetractAdvice, 'advise/retract', request, options.wait))
    if said is None:
        return _show(client, options.wait)
    if options.say is not None:
        said = _translated(client, said, options)
    if options.preview:
        return _preview(client, said, options.wait)
    return _send(client, said, options.wait)


def _translated(client: GraphClient, said: Answer, options: argparse.Namespace) -> Answer:
    """The directions that the word stands for in the open question.

    Raises:
        InputError: another question is open, or it offers other words.
    """
    client.wait('advise/status', lambda: client.learner, options.wait)
    if client.learner.query_id != said.query_id:
        opened = f'query {client.learner.query_id} is open' if client.learner.query_id else 'no query is open now'
        raise InputError(f'query {said.query_id} is not open; {opened}')
    query = convert_advice.query_from_msg(client.wait('the query', lambda: client.queries.get(said.query_id), options.wait))
    option = option_of(options.say, query.options if query else ())
    return replace(said, preferred=option.preferred, avoided=option.avoided, comment=said.comment or option.label)


def option_of(word: str, options: Sequence[AnswerOption]) -> AnswerOption:
    """The option that a word names: its own word, or that of its meaning (keep-out, fly-through).

    Raises:
        InputError: none is named so.
    """
    for option in options:
        if word.lower() in (option.word, option.meaning.name.lower().replace('_', '-')):
            return option
    offered = f'it offers {" and ".join(option.word for option in options)}' if options else 'answer it by --prefer and --avoid'
    raise InputError(f"the question has no answer '{word}'; {offered}")


def _print_reply(reply: Trigger.Response | RetractAdvice.Response) -> int:
    print(('done: ' if reply.success else 'refused: ') + reply.message)
    return ACCEPTED if reply.success else REFUSED


def _send(client: GraphClient, said: Answer, wait_s: float) -> int:
    reply = client.call(AnswerQuery, 'advise/answer', convert_advice.answer_to_request(said), wait_s)
    if not reply.accepted:
        print(f'refused: {reply.message}')
        return REFUSED
    left = '' if reply.budget_left < 0 else f'; {reply.budget_left} answers left'
    print(f'accepted as answer {reply.advice_id}: {reply.message}{left}')
    return ACCEPTED


def _preview(client: GraphClient, said: Answer, wait_s: float) -> int:
    """A preview is learnt first, so its reply may take longer than the others'."""
    request = PreviewAnswer.Request(
        query_id=said.query_id, verdict=said.verdict, preferred=list(said.preferred), avoided=list(said.avoided),
    )
    reply = client.call(PreviewAnswer, 'advise/preview', request, wait_s)
    print(('' if reply.valid else 'refused: ') + reply.message)
    return ACCEPTED if reply.valid else REFUSED


def _show(client: GraphClient, wait_s: float) -> int:
    """The open question with its map, and the answers so far."""
    client.wait('advise/status', lambda: client.learner, wait_s)
    try:
        client.wait('the end of learning', lambda: client.learner.phase != LearnerStatus.LEARNING, wait_s)
    except GraphTimeoutError:
        pass  # Its status says that it learns.
    status = client.learner
    client.wait('the advice log', lambda: _active(client) >= client.learner.answers, wait_s)
    print(log_text([convert_advice.advice_from_msg(advice) for advice in client.advice]) + '\n')
    if status.phase == LearnerStatus.ASKING:
        query = client.wait('the query', lambda: client.queries.get(status.query_id), wait_s)
        print(question_text(convert_advice.query_from_msg(query), convert.grid_from_msg(query.grid)) + '\n')
        print(status.message.replace(f'{query.question}\n', ''))
    else:
        print(status.message)
    return ACCEPTED


def _active(client: GraphClient) -> int:
    return len(client.advice) - 2 * sum(advice.retracted for advice in client.advice)
