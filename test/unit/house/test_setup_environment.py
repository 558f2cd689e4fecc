"""How an environment is made: what is out of date, beside the one in use, on polluted shells and odd paths."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from support.setting_up import ROOT, command, place_in, tools, used_place

__all__ = ['tools']


# -- tools/setup_env.py -----------------------------------------------------------------------
def test_another_ros_is_refused_by_name(tools: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, 'which', lambda name: f'/opt/ros/bin/{name}')
    monkeypatch.setenv('ROS_DISTRO', 'humble')
    with pytest.raises(tools.prerequisites.SetupError, match="ROS 2 'humble' is sourced, and this project runs on Jazzy"):
        tools.setup_env.sourced_ros()
    monkeypatch.setenv('ROS_DISTRO', 'jazzy')
    assert tools.setup_env.sourced_ros()
    monkeypatch.delenv('ROS_DISTRO')
    assert not tools.setup_env.sourced_ros()


def test_a_stamp_vouches_for_finished_work_only(tools: SimpleNamespace, tmp_path: Path) -> None:
    stamp = tmp_path / 'stamp'
    tools.setup_env.renew(stamp, 'one', lambda: None)
    assert tools.setup_env.stamped(stamp, 'one')
    assert not tools.setup_env.stamped(stamp, 'two')

    def interrupted() -> None:
        assert not stamp.exists()
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        tools.setup_env.renew(stamp, 'two', interrupted)
    assert not tools.setup_env.stamped(stamp, 'one')
    assert not tools.setup_env.stamped(stamp, 'two')


def test_a_build_is_out_of_date_when_what_colcon_reads_has_changed(
    tools: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
) -> None:
    for name in ('msg_defs', 'config', 'launch'):
        shutil.copytree(ROOT / name, tmp_path / name)
    for name in ('package.xml', 'setup.py', 'setup.cfg', 'colcon_defaults.yaml'):
        shutil.copy(ROOT / name, tmp_path)
    monkeypatch.setattr(tools.setup_env, 'ROOT', tmp_path)
    digests = [tools.setup_env.build_digest('e')]

    def changed() -> bool:
        digests.append(tools.setup_env.build_digest('e'))
        return digests[-1] != digests[-2]

    assert not changed()
    (tmp_path / 'config' / 'advise.yaml').write_text('{}')  # Linked into install/: an edit needs no build ...
    assert not changed()
    (tmp_path / 'config' / 'new.yaml').write_text('{}')  # ... but a new file has to be linked.
    assert changed()
    (tmp_path / 'msg_defs' / 'msg' / 'Policy.msg').write_text('uint32 version\n')
    assert changed()
    (tmp_path / 'setup.py').write_text('')
    assert changed()


def test_wheels_name_this_python_and_the_files_of_a_cache_stay_as_they_are(tools: SimpleNamespace, tmp_path: Path) -> None:
    place = place_in(tools, tmp_path)
    cached, share = tmp_path / 'cached.cmake', place.venv / 'share'
    builder = '/opt/python/cp311-cp311'
    cached.write_text(
        f'"{builder}/include/python3.11;{builder}/lib/python3.11/site-packages/numpy/_core/include;/usr/include"'
    )
    share.mkdir(parents=True)
    (share / 'a.cmake').hardlink_to(cached)
    shell = SimpleNamespace(run=lambda *ignored: 'a warning\n/my drones/include\n/my drones/numpy\n')
    tools.packages._name_this_python(shell, place)
    assert (share / 'a.cmake').read_text() == '"/my drones/include;/my drones/numpy;/usr/include"'
    assert builder in cached.read_text()


def test_without_header_files_they_are_fetched_before_cmake_is_shown_where_they_are(
    tools: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
) -> None:
    place, number = place_in(tools, tmp_path), f'{sys.version_info.major}.{sys.version_info.minor}'
    (tmp_path / 'requirements').mkdir()
    (tmp_path / 'requirements' / 'lock.txt').touch()
    bin_folder = tmp_path / 'bin'
    bin_folder.mkdir()
    command(bin_folder, 'apt-get', f'touch libpython{number}-dev_1.deb')
    command(bin_folder, 'dpkg-deb', f'mkdir -p usr/include/python{number} && touch usr/include/python{number}/Python.h')
    monkeypatch.setenv('PATH', f'{bin_folder}:/usr/bin:/bin')
    monkeypatch.setattr(tools.prerequisites, 'has_headers', lambda: False)

    def wheels(shell: Any, where: Any, wanted: Path) -> bool:
        (where.venv / 'share').mkdir()
        (where.venv / 'share' / 'a.cmake').write_text('"/opt/python/cp310-cp310/include/python3.10"')
        return True

    monkeypatch.setattr(tools.packages, '_install_fast', wheels)
    shell = tools.shell.Shell(tmp_path, tmp_path / 'log' / 'setup.log')
    run_really = shell.run
    shell.run = lambda what, line, env=None: '/none\n/numpy' if 'paths' in what else run_really(what, line, env)
    tools.packages.install(shell, place, system=False)
    fetched = place.path / 'headers' / 'usr' / 'include' / f'python{number}'
    assert (place.venv / 'share' / 'a.cmake').read_text() == f'"{fetched}"'


def test_header_files_that_cannot_be_had_are_named_with_their_package(
    tools: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
) -> None:
    monkeypatch.setattr(tools.prerequisites, 'has_headers', lambda: False)
    monkeypatch.setenv('PATH', '/nowhere')
    shell = tools.shell.Shell(tmp_path, tmp_path / 'setup.log')
    with pytest.raises(tools.prerequisites.SetupError, match=r'the header files of Python .*: .*apt install python3\.\d+-dev'):
        tools.packages._find_headers(shell, place_in(tools, tmp_path))


@pytest.mark.parametrize('variable', ['PYTHONPATH', 'PYTHONHOME', 'PYTHONWARNINGS', 'AMENT_PREFIX_PATH', 'PIP_USER'])
def test_what_the_shell_is_polluted_with_reaches_no_command_of_set_up(
    tools: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, variable: str,
) -> None:
    monkeypatch.setenv(variable, '/polluted')
    shell = tools.shell.Shell(tmp_path, tmp_path / 'setup.log')
    assert shell.run('looking', [sys.executable, '-c', f'import os; print(os.environ.get("{variable}"))']) == 'None\n'


def test_a_virtual_environment_is_made_in_a_polluted_shell(
    tools: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
) -> None:
    (tmp_path / 'site.py').write_text('raise SystemExit("polluted")')
    monkeypatch.setenv('PYTHONPATH', str(tmp_path))
    monkeypatch.setenv('PYTHONHOME', str(tmp_path))
    shell = tools.shell.Shell(tmp_path, tmp_path / 'setup.log')
    shell.run('making it', [tools.packages.base_python(), '-m', 'venv', '--without-pip', tmp_path / 'my venv'])
    assert shell.run('trying it', [tmp_path / 'my venv' / 'bin' / 'python', '-c', 'print(1)']) == '1\n'


def test_a_ros_that_does_not_load_is_refused_before_anything_is_made(
    tools: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
) -> None:
    place, places = used_place(tools, tmp_path)
    command(tmp_path, 'ros2', 'exit 0')
    monkeypatch.setenv('PATH', str(tmp_path))
    monkeypatch.setenv('ROS_DISTRO', 'jazzy')
    monkeypatch.setenv('PYTHONPATH', '')
    monkeypatch.setattr(tools.setup_env, 'ROOT', tmp_path)
    monkeypatch.setattr(tools.setup_env, 'environment_digest', lambda system: 'new')
    monkeypatch.setattr(tools.setup_env, 'build_digest', lambda environment: 'new')
    with pytest.raises(tools.prerequisites.SetupError, match=r'rclpy does not load in Python .*unset ROS_DISTRO') as caught:
        tools.setup_env.set_up()
    assert '\n' not in str(caught.value)
    assert (tmp_path / '.venv' / 'kept').exists()
    assert [path.name for path in (tmp_path / '.built').iterdir()] == [place.path.name]
    assert places.in_use() is not None


# -- tools/places.py --------------------------------------------------------------------------
def test_a_new_environment_takes_over_only_when_it_is_whole(tools: SimpleNamespace, tmp_path: Path) -> None:
    old, places = used_place(tools, tmp_path)
    new = places.new()
    new.venv.mkdir()
    assert (tmp_path / '.venv' / 'kept').exists()
    places.use(new)
    assert (tmp_path / '.venv').resolve() == new.venv
    assert not (tmp_path / '.venv' / 'kept').exists()
    assert not old.path.exists()


def test_half_made_environments_are_swept_away_and_the_one_in_use_is_not(tools: SimpleNamespace, tmp_path: Path) -> None:
    old, places = used_place(tools, tmp_path)
    half = places.new()
    places.sweep()
    assert old.path.exists()
    assert not half.path.exists()
    assert places.new().path != old.path


def test_links_move_with_the_checkout(tools: SimpleNamespace, tmp_path: Path) -> None:
    (tmp_path / 'here').mkdir()
    used_place(tools, tmp_path / 'here')
    (tmp_path / 'here').rename(tmp_path / 'there')
    assert (tmp_path / 'there' / '.venv' / 'kept').exists()


def test_the_directories_of_an_older_set_up_give_way(tools: SimpleNamespace, tmp_path: Path) -> None:
    (tmp_path / '.venv' / 'bin').mkdir(parents=True)
    (tmp_path / 'install').mkdir()
    assert tools.places.Places(tmp_path).in_use() is None
    used_place(tools, tmp_path)
    assert (tmp_path / '.venv' / 'kept').exists()
    assert (tmp_path / 'install').is_symlink()


def test_a_set_up_that_fails_leaves_the_environment_from_before_in_use(
    tools: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
) -> None:
    old, places = used_place(tools, tmp_path)

    def failing(*ignored: Any) -> None:
        raise tools.prerequisites.SetupError('installing packages failed')

    monkeypatch.setattr(tools.packages, 'install', failing)
    shell = tools.shell.Shell(tmp_path, tmp_path / 'setup.log')
    with pytest.raises(tools.prerequisites.SetupError, match='failed; the environment from before is still in use'):
        tools.setup_env.make_anew(shell, places, False, ('environment', 'build'))
    assert places.in_use().path == old.path
    assert [path for path in (tmp_path / '.built').iterdir() if path.is_dir()] == [old.path]


# -- tools/build.py ---------------------------------------------------------------------------
@pytest.mark.parametrize('folder', ['my drones', 'plain', 'l' * 150])
def test_an_executable_starts_from_any_path(tools: SimpleNamespace, tmp_path: Path, folder: str) -> None:
    home = tmp_path / folder
    home.mkdir()
    (home / 'python').symlink_to(sys.executable)
    script = home / 'policy'
    quote = '"' if ' ' in folder else ''  # As setuptools writes it.
    script.write_text(f'#!{quote}{home}/python{quote}\nimport sys\nprint(sys.argv[1:], __doc__)\n')
    script.chmod(0o755)
    before = script.read_text()
    tools.build.start_by_shell(script)
    assert (script.read_text() == before) == (folder == 'plain')
    done = subprocess.run([script, 'a b', "it's"], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("['a b', \"it's\"]")


def test_lock_files_name_no_index_and_hash_every_package(tools: SimpleNamespace) -> None:
    for name in ('lock.txt', 'system-lock.txt', 'system-dev-lock.txt', 'bootstrap-lock.txt'):
        text = (ROOT / 'requirements' / name).read_text()
        assert '://' not in text
        requirements = [block for block in text.split('\n') if block[:1].isalnum()]
        assert requirements
        assert all('==' in line and line.endswith('\\') for line in requirements)


def built_place(tools: SimpleNamespace, folder: Path, setup_bash: str) -> tuple[Any, Any, dict[str, str]]:
    """A place whose install/setup.bash is given, a shell and the build's environment."""
    folder.mkdir()
    place = place_in(tools, folder)
    for path in (place.venv / 'bin', place.install):
        path.mkdir(parents=True)
    (place.venv / 'bin' / 'python').symlink_to(tools.packages.base_python())
    (place.install / 'setup.bash').write_text(setup_bash)
    shell = tools.shell.Shell(folder, folder / 'log' / 'setup.log')
    return place, shell, tools.build.build_env(place, False, shell.env)


def test_what_was_built_is_reached_in_a_path_with_a_space(tools: SimpleNamespace, tmp_path: Path) -> None:
    # As colcon's own script does: the name of its Python is not quoted.
    script = '[ "$($COLCON_PYTHON_EXECUTABLE -c "print(1)")" = 1 ] && export AMENT_PREFIX_PATH="$PWD/place/install/advise_ros"\n'
    place, shell, env = built_place(tools, tmp_path / 'my drones', script)
    tools.build._write_environment(shell, place, env, False)
    ask = '. "$1/environment.sh" && echo "$AMENT_PREFIX_PATH" && command -v python'
    done = subprocess.run(['sh', '-c', ask, 'sh', place.venv], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == [f'{place.install}/advise_ros', f'{place.venv}/bin/python']


def test_a_build_that_its_own_environment_does_not_reach_is_refused(tools: SimpleNamespace, tmp_path: Path) -> None:
    place, shell, env = built_place(tools, tmp_path / 'drones', 'true\n')
    with pytest.raises(tools.prerequisites.SetupError, match='does not lead to what was built'):
        tools.build._write_environment(shell, place, env, False)
