"""What the answer command makes of its arguments before it looks for a learner."""

import pytest

from advise_ros.commands import answer
from advise_ros.core.advice.advice import Answer, AnswerOption, Meaning, Verdict
from advise_ros.core.errors import InputError


@pytest.mark.parametrize(('words', 'said'), [
    ([], None),
    (['--undo'], None),
    (['--retract', '3'], None),
    (['--query', '3', '--prefer', 'east', '--avoid', 'North, west'], Answer(3, 0, (1,), (0, 3))),
    (['--query', '3', '--prefer', 'e,s', '--avoid', '0'], Answer(3, 0, (1, 2), (0,))),
    (['--query', '3', '--prefer', 'e'], Answer(3, 0, (1,), ())),
    (['--query', '3', '--say', 'on-purpose'], Answer(3, 0)),
    (['--query', '9', '--mixed', '--expert', 'anna', '--comment', 'no'], Answer(9, Verdict.MIXED, (), (), 'anna', 'no')),
])  # fmt: skip
def test_the_answer_that_is_spelt(words: list[str], said: Answer | None) -> None:
    assert answer._answer(answer._parser().parse_args(words)) == said


@pytest.mark.parametrize(('words', 'sentence'), [
    (['--query', '3', '--prefer', 'up', '--avoid', 'n'], "action 'up' is unknown; actions: north, east, south, west"),
    (['--prefer', 'e', '--avoid', 'n'], 'say which query is answered by --query ID'),
    (['--skip'], 'say which query is answered by --query ID'),
    (['--query', '3'], 'query 3 needs an answer'),
    (['--query', '0', '--skip'], '--query is 0; query ids count up from 1'),
    (['--query', '-4', '--skip'], '--query is -4; query ids count up from 1'),
    (['--query', '3', '--prefer', 'e', '--unsure'], 'drop the other one'),
    (['--undo', '--avoid', 'e'], 'drop the other one'),
    (['--query', '3', '--say', 'yes', '--skip'], '--say is an answer of its own; drop the other one'),
    (['--say', 'on-purpose'], 'say which query is answered by --query ID'),
])  # fmt: skip
def test_what_does_not_fit_together_is_one_sentence(
    words: list[str], sentence: str, capsys: pytest.CaptureFixture[str],
) -> None:
    assert answer.run(words) == 2
    err = capsys.readouterr().err
    assert err.startswith('error: ') and sentence in err and err.count('\n') == 1


def test_a_word_is_that_of_the_question_or_of_its_meaning() -> None:
    keep, through = (
        AnswerOption(Meaning.KEEP_OUT, 'on-purpose', 'On purpose: keep out', (0,), (1,)),
        AnswerOption(Meaning.FLY_THROUGH, 'by-accident', 'By accident: fly through', (1,), (0,)),
    )
    assert answer.option_of('On-Purpose', (keep, through)) is keep
    assert answer.option_of('fly-through', (keep, through)) is through
    with pytest.raises(InputError, match="no answer 'maybe'; it offers on-purpose and by-accident"):
        answer.option_of('maybe', (keep, through))
    with pytest.raises(InputError, match='answer it by --prefer and --avoid'):
        answer.option_of('on-purpose', ())


@pytest.mark.parametrize('words', [['--skip', '--undo'], ['--query', 'three', '--skip'], ['now'], ['--retract']])
def test_wrong_usage_exits_with_2(words: list[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        answer.run(words)
    assert ended.value.code == 2
