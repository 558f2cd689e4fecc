"""Names and versions that stand in several places are the same in all of them."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

import advise_ros
from advise_ros import config
from advise_ros.ros.topics import RECORDED
from support.paths import ROOT

README = (ROOT / 'README.md').read_text(encoding='utf-8')
GRAPH_PAGE = (ROOT / 'docs' / 'ros.md').read_text(encoding='utf-8')
SETUP = (ROOT / 'setup.py').read_text(encoding='utf-8')
NODES = ast.literal_eval(re.search(r'^NODES = (\(.*?\))$', SETUP, re.DOTALL | re.MULTILINE)[1])  # type: ignore[index]
COMMANDS = ast.literal_eval(re.search(r'^COMMANDS = (\(.*?\))$', SETUP, re.DOTALL | re.MULTILINE)[1])  # type: ignore[index]
INTERFACES = [path for kind in ('msg', 'srv', 'action') for path in (ROOT / 'msg_defs' / kind).iterdir()]
# Where a rclpy call has the name of what it opens.
NAME_ARGUMENT = {'create_publisher': 1, 'create_subscription': 1, 'create_service': 1, 'ActionServer': 2}


def listed_in(page: str, heading: str) -> list[str]:
    """Names in backquotes in the first column of a page's table whose header row starts with `heading`."""
    table = re.search(rf'^\| {heading} \|.*\n\| --- .*\n((?:\|.*\n)+)', page, re.MULTILINE)
    assert table is not None, f'no table begins with {heading!r}'
    return [name for row in table[1].splitlines() for name in re.findall(r'`([^`]+)`', row.split('|')[1])]


def opened_names() -> Iterator[str]:
    """Literal names of topics, services and actions that nodes open, as patterns."""
    for path in [*(ROOT / 'advise_ros' / 'nodes').glob('*.py'), *(ROOT / 'advise_ros' / 'ros').glob('*.py')]:
        for call in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(call, ast.Call):
                function = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, 'id', '')
                place = NAME_ARGUMENT.get(function, len(call.args))
                yield from (_pattern(argument) for argument in call.args[place:place + 1])


def _pattern(argument: ast.expr) -> str:
    if isinstance(argument, ast.Constant):
        return re.escape(str(argument.value))
    if isinstance(argument, ast.JoinedStr):
        return ''.join(re.escape(part.value) if isinstance(part, ast.Constant) else r'\w+' for part in argument.values)
    return ''  # A name that is not literal; its readers are compared by topics.RECORDED and the tests of the node.


def test_every_executable_has_its_module_with_a_main() -> None:
    for folder, names in (('nodes', NODES), ('commands', COMMANDS)):
        for name in names:
            assert '\ndef main(' in (ROOT / 'advise_ros' / folder / f'{name}.py').read_text(encoding='utf-8')


def test_readme_lists_every_executable_and_no_other() -> None:
    assert sorted(listed_in(README, 'executable')) == sorted((*NODES, *COMMANDS))


def test_the_page_of_the_graph_lists_every_topic_service_and_action_that_nodes_open_and_no_other() -> None:
    listed = {name for kind in ('topic', 'service or action') for name in listed_in(GRAPH_PAGE, kind)}
    opened = {pattern for pattern in opened_names() if pattern}
    strange = [name for name in listed if name not in RECORDED and not any(re.fullmatch(pattern, name) for pattern in opened)]
    assert not strange, 'docs/ros.md names what no node opens'
    literal = {re.sub(r'\\(.)', r'\1', pattern) for pattern in opened if r'\w+' not in pattern}
    assert literal - listed == {'/clock'}, 'nodes open what docs/ros.md does not name'
    assert set(RECORDED) <= listed


def test_the_parameter_file_has_the_names_and_defaults_of_the_code() -> None:
    tree = yaml.safe_load((ROOT / 'config' / 'advise.yaml').read_text(encoding='utf-8'))
    assert set(tree) == {f'/**/{name}' for name in NODES}
    for name in NODES:
        owner = getattr(config, ''.join(word.capitalize() for word in name.split('_')) + 'Config')
        written, wanted = tree[f'/**/{name}']['ros__parameters'], config.defaults(owner)
        assert written == wanted, f'{name}: run ./advise python tools/parameters.py'
        assert {key: type(value) for key, value in written.items()} == {key: type(value) for key, value in wanted.items()}


def test_the_parameter_file_and_page_are_those_that_their_tool_writes() -> None:
    done = subprocess.run([sys.executable, ROOT / 'tools' / 'parameters.py', '--check'], check=False)
    assert done.returncode == 0, 'run ./advise python tools/parameters.py'


@pytest.mark.parametrize('path', sorted((ROOT / 'config').glob('*.yaml')), ids=lambda path: path.name)
def test_shipped_parameter_files_hold_what_the_nodes_accept(path: Path) -> None:
    tree = yaml.safe_load(path.read_text(encoding='utf-8'))
    entries = {key.rsplit('/', 1)[-1]: entry['ros__parameters'] for key, entry in tree.items() if 'ros__parameters' in entry}
    assert entries or 'grid' in tree or 'keep_out' in tree
    for name, values in entries.items():
        owner = getattr(config, ''.join(word.capitalize() for word in name.split('_')) + 'Config')
        assert config.build(owner, values)


def test_the_interface_package_builds_every_file_it_has() -> None:
    listed = re.findall(r'"((?:msg|srv|action)/\w+\.\w+)"', (ROOT / 'msg_defs' / 'CMakeLists.txt').read_text(encoding='utf-8'))
    found = [path.relative_to(ROOT / 'msg_defs').as_posix() for path in INTERFACES]
    assert sorted(listed) == sorted(found)


def test_the_interface_package_declares_what_its_files_use() -> None:
    cmake = (ROOT / 'msg_defs' / 'CMakeLists.txt').read_text(encoding='utf-8')
    declared = set(re.search(r'DEPENDENCIES ([\w ]+)', cmake)[1].split())  # type: ignore[index]
    used = {name for path in INTERFACES for name in re.findall(r'^(\w+)/\w+', path.read_text(encoding='utf-8'), re.MULTILINE)}
    depends = {element.text for element in ET.parse(ROOT / 'msg_defs' / 'package.xml').getroot().iter('depend')}
    assert used - {'advise_msgs'} == declared
    assert declared <= depends


def test_one_version_everywhere() -> None:
    versions = {
        'advise_ros/__init__.py': advise_ros.__version__,
        'setup.py': re.search(r"version='([^']+)'", SETUP)[1],  # type: ignore[index]
        'package.xml': ET.parse(ROOT / 'package.xml').getroot().findtext('version'),
        'msg_defs/package.xml': ET.parse(ROOT / 'msg_defs' / 'package.xml').getroot().findtext('version'),
        'CHANGELOG.md': re.search(r'^## (\d\S*)', (ROOT / 'CHANGELOG.md').read_text(encoding='utf-8'), re.MULTILINE)[1],  # type: ignore[index]
    }
    assert len(set(versions.values())) == 1, versions


def imported_packages() -> set[str]:
    """Top-level packages that the code imports."""
    found = set()
    for path in (ROOT / 'advise_ros').rglob('*.py'):
        for statement in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(statement, ast.Import):
                found |= {alias.name.split('.')[0] for alias in statement.names}
            elif isinstance(statement, ast.ImportFrom) and statement.module and not statement.level:
                found.add(statement.module.split('.')[0])
    return found - set(sys.stdlib_module_names) - {'advise_ros'}


def test_package_xml_and_requirements_name_all_that_is_imported() -> None:
    root = ET.parse(ROOT / 'package.xml').getroot()
    declared = {element.text for kind in ('depend', 'exec_depend') for element in root.iter(kind)}
    required = set(re.findall(r'^([a-z0-9-]+)', (ROOT / 'requirements' / 'app.in').read_text(encoding='utf-8'), re.MULTILINE))
    # pytest imports its plugin itself; mcap, scikit-learn, nicegui and fastkml bring the others along.
    brought = {'pytest', 'zstandard', 'lz4', 'threadpoolctl', 'fastapi', 'pygeoif'}
    on_pypi_as = {
        'sklearn': 'scikit-learn', 'yaml': 'pyyaml', 'serial': 'pyserial', 'mcap_ros2': 'mcap-ros2-support', 'PIL': 'pillow',
    }
    needed = imported_packages() - brought
    assert {name for name in needed if name not in declared and on_pypi_as.get(name, name) not in required} == set()
