"""Words for people: what to type for the open question, with the `ros2` command and without."""

from __future__ import annotations

from collections.abc import Sequence

from advise_ros.core.advice.advice import Answer, Verdict
from advise_ros.core.grid.grid import Action

# What stands for the answer, so that nobody gives one that was only an example.
RIGHT, WRONG = 'RIGHT', 'WRONG'
MEANING = f'for {RIGHT} and {WRONG} put directions, joined by commas: north, east, south, west, or 0, 1, 2, 3'


def service_call(service: str, query_id: int) -> str:
    """A `ros2 service call` line; `service` is the resolved name."""
    request = f'{{query_id: {query_id}, verdict: 0, preferred: [{RIGHT}], avoided: [{WRONG}]}}'
    return f'ros2 service call {service} advise_msgs/srv/AnswerQuery "{request}"'


def answer_command(namespace: str, query_id: int, said: str = f'--prefer {RIGHT} --avoid {WRONG}') -> str:
    """The `./advise answer` line; `namespace` is the learner's."""
    tail = '' if namespace == '/' else f' --ros-args -r __ns:={namespace}'
    return f'./advise answer --query {query_id} {said}{tail}'


def how_to_answer(service: str, namespace: str, query_id: int, words: Sequence[str] = ()) -> str:
    """The lines to type: one for each answer of one word, and those that name directions.

    Args:
        service: resolved name.
        namespace: of the learner.
        query_id: of the question.
        words: of its options.
    """
    directions = service_call(service, query_id), answer_command(namespace, query_id)
    head = f'To answer query {query_id}{" by directions" if words else ""} ({MEANING}):'
    by_word = [f'To answer query {query_id}:', *(f'  {answer_command(namespace, query_id, f"--say {word}")}' for word in words)]
    return '\n'.join((*(by_word if words else ()), head, *(f'  {line}' for line in directions)))


def cannot_hold(contradictions: tuple[int, ...]) -> str:
    """About advice ids that `Learned.contradictions` names."""
    if len(contradictions) == 1:
        return f'answer {contradictions[0]} cannot hold in all of its states'
    return f'answers {", ".join(map(str, contradictions))} cannot all hold in all of their states'


def in_words(answer: Answer) -> str:
    """E.g. 'query 3: prefer EAST, avoid NORTH and WEST'; actions must be valid."""
    if answer.verdict != Verdict.ANSWER:
        return f'query {answer.query_id}: {Verdict(answer.verdict).name}'
    preferred, avoided = (' and '.join(Action(a).name for a in actions) for actions in (answer.preferred, answer.avoided))
    return f'query {answer.query_id}: prefer {preferred}, avoid {avoided}'
