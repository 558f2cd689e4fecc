"""The person's page when things go wrong: strangers, two people at once, a learner or a console that is gone."""

from __future__ import annotations

import http.client
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, expect
from std_srvs.srv import Trigger

from advise_ros.core.advice.advice import Code
from advise_ros.recording.demofile import save_demonstrations
from support.browser import Person, start_console
from support.graph import Graph
from support.learner import Learner, write_grid
from support.walks import GRID_4X4, walk

INJECTION = '<img src=x onerror="document.title=1"><script>document.title=2</script>'
TOKEN = 'known-to-the-test'  # noqa: S105
SILENCE = {'silence_s': 1.5}


@pytest.fixture
def kept_files(tmp_path: Path) -> dict[str, object]:
    """Files with which a learner that is started again goes on where it was."""
    demonstrations = tmp_path / 'demonstrations.json'
    save_demonstrations(demonstrations, [walk(GRID_4X4, number) for number in (0, 1)])
    return {
        'grid_file': write_grid(tmp_path, GRID_4X4), 'demonstrations_file': str(demonstrations),
        'session_file': str(tmp_path / 'session.jsonl'),
    }


def start_learner(graph: Graph, files: dict[str, object]) -> Learner:
    others = {name: value for name, value in files.items() if name != 'grid_file'}
    return Learner(graph, str(files['grid_file']), **others)


def answers_to(learner: Learner, expert: str) -> list[int]:
    return [message.query_id for message in learner.log if message.expert_id == expert and not message.retracted]


# -- strangers -------------------------------------------------------------------------------
def ask(address: str, path: str, method: str = 'GET', **headers: str) -> http.client.HTTPResponse:
    connection = http.client.HTTPConnection(urlsplit(address).netloc, timeout=20)
    connection.request(method, path, headers=headers)
    return connection.getresponse()


def test_strangers_are_turned_away(graph: Graph) -> None:
    _, address = start_console(graph)
    token = urlsplit(address).query
    entered = ask(address, f'/?{token}')
    cookie = entered.headers['set-cookie']
    assert (entered.status, entered.headers['location']) == (303, '/')
    assert 'HttpOnly' in cookie and 'SameSite=Strict' in cookie
    ours = {'Cookie': cookie.partition(';')[0]}
    page = ask(address, '/', **ours)
    assert page.status == 200
    assert "frame-ancestors 'none'" in page.headers['content-security-policy']
    assert ask(address, '/').status == 403
    assert ask(address, '/?token=wrong').status == 403
    assert ask(address, '/', Host='evil.example', **ours).status == 421
    assert ask(address, f'/?{token}', Host='evil.example').status == 421
    assert ask(address, '/', Origin='http://evil.example', **ours).status == 403
    assert ask(address, '/', 'POST', **ours).status == 405
    assert ask(address, '/console/app.js').status == 403
    socket = '/_nicegui_ws/socket.io/?EIO=4&transport='
    assert ask(address, f'{socket}polling', **ours).status == 400
    key = {'Sec-WebSocket-Version': '13', 'Sec-WebSocket-Key': 'x' * 22 + '=='}
    upgrade = {'Connection': 'Upgrade', 'Upgrade': 'websocket', **key}
    assert ask(address, f'{socket}websocket', **upgrade, **ours).status == 403, 'a socket without origin'
    assert ask(address, f'{socket}websocket', Origin='http://evil.example', **upgrade, **ours).status == 403
    own = 'http://' + urlsplit(address).netloc
    assert ask(address, f'{socket}websocket', Origin=own, **upgrade).status == 403, 'a socket without token'
    assert ask(address, f'{socket}websocket', Origin=own, **upgrade, **ours).status == 101


def test_a_port_in_use_is_one_sentence(graph: Graph) -> None:
    _, address = start_console(graph)
    second = graph.run('console', '--ros-args', '-p', f'port:={urlsplit(address).port}')
    assert second.popen.returncode == 2
    assert 'which cannot be used on 127.0.0.1 (address already in use)' in second.err[-1]


# -- several people --------------------------------------------------------------------------
def test_two_people_see_each_other_and_the_first_answer_wins(
    graph: Graph, kept_files: dict[str, object], browser: Browser,
) -> None:
    learner = start_learner(graph, kept_files)
    _, address = start_console(graph)
    anna, ben = Person(browser, address, 'Anna'), Person(browser, address, INJECTION)
    for person in (anna, ben):
        person.asked(1)
        person.shows('people', '2 windows')
        person.press('ArrowRight')
    ben.page.get_by_label('Comment').fill(INJECTION)
    ben.page.get_by_label('Comment').press('Enter')
    anna.history('EAST, not WEST', INJECTION)
    for person in (anna, ben):
        person.asked(2)
        assert person.page.title() == 'advise'
        expect(person.page.locator('img, .history script')).to_have_count(0)
    graph.wait_until(lambda: learner.log, what='the answer in the log')
    assert list(learner.log[0].preferred) == [1]
    refused = anna.late_answer(1, list(learner.log[0].states))
    assert (refused['ok'], refused['code']) == (False, Code.ALREADY_ANSWERED)
    assert [message.query_id for message in learner.log] == [1]
    assert not anna.errors and not ben.errors


# -- losses ----------------------------------------------------------------------------------
def test_an_answer_is_kept_while_the_learner_is_away_and_given_once(
    graph: Graph, kept_files: dict[str, object], browser: Browser,
) -> None:
    learner = start_learner(graph, kept_files)
    _, address = start_console(graph, **SILENCE)
    anna = Person(browser, address, 'Anna')
    anna.asked(1)
    anna.press('ArrowRight', 'Enter')
    anna.history('EAST, not WEST', 'changed')
    anna.asked(2)
    learner.process.kill()
    anna.shows('alarm', 'The learner is silent')
    anna.press('ArrowUp', 'Enter')
    anna.shows('kept', '1 answer on the way')
    again = start_learner(graph, kept_files)
    anna.history('NORTH, not SOUTH', 'Anna', 'changed')
    anna.hides('alarm')
    anna.hides('kept')
    graph.wait_until(lambda: len(answers_to(again, 'Anna')) > 1, what='the learner to publish the answer')
    assert len(answers_to(again, 'Anna')) == 2, 'the restored one and the kept one'
    entries = anna.page.locator('.history li')
    expect(entries).to_have_count(2)
    expect(entries.last).to_contain_text('changed')
    assert not anna.errors


def test_an_answer_is_kept_while_the_console_is_away_and_given_once(
    graph: Graph, kept_files: dict[str, object], browser: Browser, free_tcp_port: int,
) -> None:
    learner = start_learner(graph, kept_files)
    console, address = start_console(graph, port=free_tcp_port, token=TOKEN)
    anna = Person(browser, address, 'Anna')
    anna.asked(1)
    console.kill()
    anna.shows('alarm', 'No connection to the console')
    anna.press(' ')
    anna.shows('note', 'there is no connection to the console; nothing was done')
    anna.press('ArrowRight', 'Enter')
    anna.shows('kept', '1 answer on the way')
    start_console(graph, port=free_tcp_port, token=TOKEN)
    anna.history('EAST, not WEST', 'Anna')
    anna.hides('alarm')
    anna.asked(2)
    graph.wait_until(lambda: answers_to(learner, 'Anna'), what='the learner to publish the answer')
    assert answers_to(learner, 'Anna') == [1]
    assert not anna.errors


# -- the drone -------------------------------------------------------------------------------
def test_hold_works_from_anywhere_and_tells_what_came_of_it(graph: Graph, browser: Browser) -> None:
    _, address = start_console(graph)
    held: list[str] = []

    def hold(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        held.append('held')
        response.success, response.message = True, 'holding'
        return response

    anna = Person(browser, address)
    anna.press(' ')  # The page is live, so this arrives.
    anna.shows('note', 'HOLD: nobody serves /policy/stop; is its node running?')
    graph.in_node_thread(lambda: graph.node.create_service(Trigger, 'policy/stop', hold))
    anna.hold_until(lambda: bool(held))
    anna.shows('note', 'HOLD: holding.')
    anna.page.get_by_label('Your name').press(' ')  # In a text field a space is a space.
    anna.page.get_by_label('Your name').blur()
    anna.rests()
    before = len(held)
    anna.click('^Hold')
    graph.wait_until(lambda: len(held) == before + 1, what='the second hold')
    assert not anna.errors


def test_a_page_whose_line_is_not_up_says_so_and_refuses(graph: Graph, browser: Browser) -> None:
    _, address = start_console(graph)
    context = browser.new_context()
    page = context.new_page()
    page.route_web_socket('**/socket.io/**', lambda _: None)  # It opens, and nobody is there.
    page.goto(address)
    connection = page.locator('[data-test=connection]')
    connection.wait_for()
    page.keyboard.press(' ')
    expect(page.locator('[data-test=note]')).to_contain_text('there is no connection to the console; nothing was done')
    expect(page.get_by_role('button', name='Fly the policy')).to_be_disabled()
    expect(connection).to_contain_text('cut off')
    expect(page.locator('[data-test=alarm]')).to_contain_text('No connection to the console')
