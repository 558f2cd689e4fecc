"""Proves that what the README names is enough: `make demo` on minimal Debian systems, made for it and thrown away.

    make test-bare                                      Debian 12 and 13, as root and as an ordinary user
    make test-bare ARGS='--suites trixie --as user'     a part of it
    make test-bare ARGS='--keep'                        leave the systems where they are, and say where

Each system is debootstrap's smallest. Into it goes what the README's first `apt install` line names, nothing else, and
this commit, cloned into a path with a space. How this machine reaches its package registries (environment variables of
proxies, pip, uv and certificates, and pip's, apt's and the resolver's files) is taken over as it is. Takes root,
debootstrap, 8 GB and half an hour. Exit code 0 when every demo ended well, 1 when one did not, 2 when it
cannot be tried here.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
SUITES = ('bookworm', 'trixie')
PEOPLE = {'root': '/root', 'user': '/home/anna'}
FOLDER = 'my drones/advise_ros'
APT_LINE = re.compile(r'^\$ sudo apt install (?P<packages>[a-z0-9 .+-]+?)\s*(?:#.*)?$', re.MULTILINE)
# Environment variables that say how the network is reached.
NETWORK = re.compile(r'^(PIP_.*|UV_.*|SSL_CERT_(FILE|DIR)|(REQUESTS|CURL)_CA_BUNDLE|(https?|all|no|ftp)_proxy)$', re.IGNORECASE)
NETWORK_FILES = ('/etc/resolv.conf', '/etc/hosts', '/etc/pip.conf', '/etc/xdg/pip/pip.conf')
PATIENCE_S = 5400.0
# A domain of its own: another graph on this machine is not to be joined.
DOMAIN = '97'
DEMO = 'make demo'
TABLE = 'What the map does not say'


class RefusedError(Exception):
    """Why it cannot be tried here."""


class Tried(NamedTuple):
    """What came of one demo."""

    suite: str
    python: str
    person: str
    seconds: float
    code: int
    good: bool
    log: Path


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--suites', nargs='+', default=SUITES, help='Debian releases (default %(default)s)')
    parser.add_argument('--as', nargs='+', dest='people', choices=PEOPLE, default=tuple(PEOPLE), help='by whom (default both)')
    parser.add_argument('--mirror', default='', help='Debian mirror (default: the one of this machine)')
    parser.add_argument('--command', default=DEMO, help='what is run in the clone (default %(default)s)')
    parser.add_argument('--folder', type=Path, default=None, help='where to make the systems (default: a temporary folder)')
    parser.add_argument('--keep', action='store_true', help='leave the systems where they are')
    return parser.parse_args()


def readme_packages() -> list[str]:
    """What the README's first screen tells to install.

    Raises:
        RefusedError: it has no such line.
    """
    line = APT_LINE.search((ROOT / 'README.md').read_text(encoding='utf-8'))
    if line is None:
        raise RefusedError('README.md has no line `$ sudo apt install ...` that could be tried')
    return line['packages'].split()


def look_at_the_machine() -> None:
    """Refuse a machine that cannot make systems.

    Raises:
        RefusedError: names all that is missing.
    """
    missing = [name for name in ('debootstrap', 'unshare', 'chroot', 'git') if shutil.which(name) is None]
    reasons = [f'{", ".join(missing)} missing (apt install debootstrap util-linux git)'] if missing else []
    if os.geteuid() != 0:
        reasons.append('only root can make Debian systems: sudo make test-bare')
    if reasons:
        raise RefusedError('; '.join(reasons))


class System:
    """A minimal Debian in a folder. Mounts are made in namespaces of single commands, so none is ever left behind."""

    def __init__(self, root: Path, suite: str) -> None:
        self.root, self.suite = root, suite
        self.log = root.with_name(f'{suite}.log')

    def make(self, mirror: str) -> None:
        """Bootstrap it and let it reach the network as this machine does."""
        command = ['debootstrap', '--variant=minbase', self.suite, str(self.root)]
        self._note(subprocess.run([*command, *([mirror] if mirror else [])], capture_output=True, text=True, check=False))
        self._reach_the_network()
        (self.root / 'etc/apt/apt.conf.d/99network').write_text(apt_settings())

    def install(self, packages: list[str]) -> None:
        apt = 'apt-get -qq update && apt-get -qq -y --no-install-recommends install'
        self.run('root', f'{apt} {shlex.join(packages)}')
        self.run('root', 'useradd --create-home --shell /bin/sh anna')
        self._reach_the_network()  # A package may have written its own certificates over this machine's.

    def clone(self, bundle: Path, person: str) -> None:
        shutil.copy(bundle, self.root / 'opt/advise_ros.bundle')
        folder = shlex.quote(str(Path(PEOPLE[person], FOLDER)))
        self.run(person, f'git clone -q /opt/advise_ros.bundle {folder}')

    def run(self, person: str, command: str) -> str:
        """Output of a command that has to succeed.

        Raises:
            RefusedError: it failed.
        """
        done = subprocess.run(self.command(person, command), capture_output=True, text=True, check=False)
        self._note(done)
        return done.stdout

    def command(self, person: str, command: str) -> list[str]:
        """The command line of a shell within; everything that it starts ends with it."""
        root, user = shlex.quote(str(self.root)), 'anna' if person == 'user' else 'root'
        home = PEOPLE[person]
        variables = {
            'HOME': home, 'USER': user, 'LOGNAME': user, 'PATH': '/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin', 'TERM': 'dumb',
            'DEBIAN_FRONTEND': 'noninteractive', 'ROS_DOMAIN_ID': DOMAIN,
            **{name: value for name, value in os.environ.items() if NETWORK.match(name)},
        }
        within = ['env', '-i', *(f'{name}={value}' for name, value in variables.items()), 'sh', '-c', command]
        ids = '' if user == 'root' else '--userspec=anna:anna '
        steps = (
            f'mount -t proc proc {root}/proc',
            f'mount --rbind /dev {root}/dev',
            f'mount --rbind /sys {root}/sys',
            f'exec chroot {ids}{root} {shlex.join(within)}',
        )
        return ['unshare', '--mount', '--pid', '--fork', '--kill-child', 'sh', '-ec', '\n'.join(steps)]

    def _reach_the_network(self) -> None:
        """Copy the files that say how this machine does."""
        for name in (*NETWORK_FILES, *self._named_files()):
            self._take_over(Path(name))

    def _named_files(self) -> list[str]:
        """Files and folders that the network's environment variables name."""
        named = (value for name, value in os.environ.items() if NETWORK.match(name))
        return [value for value in named if value.startswith('/') and Path(value).exists()]

    def _take_over(self, path: Path) -> None:
        """Copy a file, or a folder that is not there yet; a link in the system is replaced, since it could lead out of it."""
        inside = self.root / str(path).lstrip('/')
        if not inside.parent.resolve().is_relative_to(self.root.resolve()):
            raise RefusedError(f'{path} of {self.suite} lies outside of {self.root}')
        inside.parent.mkdir(parents=True, exist_ok=True)
        if path.is_file():
            inside.unlink(missing_ok=True)
            shutil.copy(path, inside)
        elif path.is_dir() and not inside.exists():
            shutil.copytree(path, inside)

    def _note(self, done: subprocess.CompletedProcess[str]) -> None:
        with self.log.open('a') as log:
            log.write(f'$ {shlex.join(done.args)}\n{done.stdout}{done.stderr}\n')
        if done.returncode:
            last = (done.stderr or done.stdout).strip().splitlines()[-1:] or ['no output']
            raise RefusedError(f'{self.suite} could not be made: {last[0]} (log: {self.log})')


def apt_settings() -> str:
    """How this machine's apt reaches its mirror: its settings of proxies, certificates and dates."""
    listed = subprocess.run(['apt-config', 'dump'], capture_output=True, text=True, check=True).stdout
    wanted = re.compile(r'^Acquire::(.*Proxy.*|https?::.*|Check-.*|Retries) ', re.IGNORECASE)
    return ''.join(f'{line}\n' for line in listed.splitlines() if wanted.match(line))


def this_mirror() -> str:
    """The Debian mirror of this machine; '' for debootstrap's own."""
    asked = ['apt-get', 'indextargets', '--format', '$(REPO_URI) $(ORIGIN) $(LABEL)', 'Created-By: Packages']
    listed = subprocess.run(asked, capture_output=True, text=True, check=False).stdout
    return next((line.split()[0] for line in listed.splitlines() if line.endswith(' Debian Debian')), '')


def demo(system: System, person: str, command: str, log: Path) -> Tried:
    """Run the demo in the clone of one person."""
    python = system.run(person, 'python3 -V').removeprefix('Python ').strip()
    began = time.monotonic()
    folder = shlex.quote(f'{PEOPLE[person]}/{FOLDER}')
    with log.open('wb') as sink:
        try:
            done = subprocess.run(
                system.command(person, f'cd {folder} && exec {command}'), stdin=subprocess.DEVNULL, stdout=sink,
                stderr=subprocess.STDOUT, check=False, timeout=PATIENCE_S,
            )
            code = done.returncode
        except subprocess.TimeoutExpired:
            code = 124
    good = code == 0 and (command != DEMO or TABLE in log.read_text(errors='replace'))
    return Tried(system.suite, python, person, time.monotonic() - began, code, good, log)


def table(rows: list[Tried]) -> str:
    """One line a demo."""
    lines = [f'{"system":10} {"Python":8} {"as":6} {"seconds":>8} {"exit":>5}  result']
    for row in rows:
        result = 'well' if row.good else f'FAILED, see {row.log}'
        lines.append(f'{row.suite:10} {row.python:8} {row.person:6} {row.seconds:8.0f} {row.code:5}  {result}')
    return '\n'.join(lines)


def say(text: str) -> None:
    print(text, flush=True)


def try_suite(folder: Path, suite: str, given: argparse.Namespace, bundle: Path) -> list[Tried]:
    """All demos on one system; it is removed afterwards, its logs stay."""
    system = System(folder / suite, suite)
    try:
        began = time.monotonic()
        system.make(given.mirror or this_mirror())
        system.install(given.packages)
        say(f'{suite}: minimal system with {" ".join(given.packages)} ({time.monotonic() - began:.0f} s)')
        return [try_demo(system, person, given.command, bundle) for person in given.people]
    finally:
        if not given.keep:
            shutil.rmtree(system.root, ignore_errors=True)


def try_demo(system: System, person: str, command: str, bundle: Path) -> Tried:
    """One person's demo, with what it printed."""
    system.clone(bundle, person)
    tried = demo(system, person, command, system.root.with_name(f'{system.suite}-{person}.log'))
    say(f'{system.suite}: `{command}` as {person}: exit code {tried.code} after {tried.seconds:.0f} s')
    say(''.join(f'    {line}\n' for line in tried.log.read_text(errors='replace').splitlines()))
    return tried


def main() -> int:
    given = parse()
    try:
        look_at_the_machine()
        given.packages = readme_packages()
        folder = given.folder or Path(tempfile.mkdtemp(prefix='advise_bare.'))
        folder.mkdir(parents=True, exist_ok=True)
        bundle = folder / 'advise_ros.bundle'
        subprocess.run(['git', '-C', ROOT, 'bundle', 'create', '-q', bundle, 'HEAD'], check=True)
        commit = subprocess.run(['git', '-C', ROOT, 'log', '-1', '--format=%h %s'], capture_output=True, text=True, check=True)
        say(f'commit {commit.stdout.strip()} (changes that are not committed are not tried); logs in {folder}')
        rows = [row for suite in given.suites for row in try_suite(folder, suite, given, bundle)]
    except RefusedError as problem:
        print(f'error: {problem}', file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print('\ninterrupted; the systems are removed', file=sys.stderr)
        return 130
    say(table(rows))
    return 0 if all(row.good for row in rows) else 1


if __name__ == '__main__':
    sys.exit(main())
