"""Coverage-guided fuzzing; what it finds is kept in corpus/, and every test run replays it.

    make fuzz                                                 a minute each
    ./advise python test/fuzz/run.py framing --seconds 3600   one target for longer
"""

from __future__ import annotations

import argparse
import importlib.util
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import FrameType

CORPUS = Path(__file__).parent / 'corpus'
LONGEST_INPUT = 2048
Target = Callable[[bytes], None]
INSTRUMENTED = ['advise_ros']


def main() -> None:
    names = sorted(path.name for path in CORPUS.iterdir() if path.is_dir())
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('targets', nargs='*', metavar='target', help=f'of {", ".join(names)}; default: all')
    parser.add_argument('--seconds', type=int, default=60, help='for each target (default %(default)s)')
    parser.add_argument('--found', help=argparse.SUPPRESS)
    options = parser.parse_args()
    if unknown := set(options.targets) - set(names):
        parser.error(f'no target: {", ".join(sorted(unknown))}')
    if options.found:
        fuzz(options.targets[0], options.seconds, options.found)
    if importlib.util.find_spec('atheris') is None:
        sys.exit('atheris has no wheel for this Python; take 3.11 or newer on x86-64')
    sys.exit(max(grow(name, options.seconds) for name in options.targets or names))


def grow(name: str, seconds: int) -> int:
    """Fuzz one target in a process of its own, and keep the inputs that reach more code than the kept ones."""
    with tempfile.TemporaryDirectory(prefix=f'fuzz-{name}-') as found:
        command = [sys.executable, __file__, name, '--seconds', str(seconds), '--found', found]
        status = subprocess.run(command, check=False).returncode
        print(f'{name}: {"sound" if status == 0 else "BROKEN, see corpus/"}; {keep(name, Path(found))} new inputs are kept')
    return min(abs(status), 1)


def keep(name: str, found: Path) -> int:
    """Copy the inputs that reach lines in an order that no kept one does; how many."""
    target = targets()[name]
    target(b'')  # What is made once is no input's merit.
    known = {arc for path in sorted((CORPUS / name).iterdir()) for arc in arcs(target, path.read_bytes())}
    kept = 0
    for path in sorted(found.iterdir(), key=lambda path: (path.stat().st_size, path.name)):
        reached = arcs(target, path.read_bytes())
        if reached - known:
            known |= reached
            kept += 1
            shutil.copy(path, CORPUS / name / path.name[:16])
    return kept


def targets() -> dict[str, Target]:
    """Late, as the fuzzing process instruments what this imports."""
    sys.path[:0] = [str(Path(__file__).parents[1])]
    from fuzz.targets import TARGETS

    return TARGETS


def arcs(target: Target, data: bytes) -> set[tuple[str, int, int]]:
    """Pairs of lines of the package that are run one after the other."""
    seen: set[tuple[str, int, int]] = set()

    def follow(frame: FrameType, event: str, _: object) -> object:
        if 'advise_ros' not in frame.f_code.co_filename:
            return None
        last = frame.f_lineno

        def line(frame: FrameType, event: str, _: object) -> object:
            nonlocal last
            seen.add((frame.f_code.co_filename, last, frame.f_lineno))
            last = frame.f_lineno
            return line

        return line

    sys.settrace(follow)  # type: ignore[arg-type]
    try:
        target(data)
    except AssertionError:
        pass  # It is kept as broken-*.
    finally:
        sys.settrace(None)
    return seen


def fuzz(name: str, seconds: int, found: str) -> None:
    """Until the time is over or an input breaks a promise; ends the process."""
    import atheris

    with atheris.instrument_imports(include=INSTRUMENTED):
        target = targets()[name]
    target(b'')
    atheris.Setup([
        sys.argv[0], found, str(CORPUS / name), f'-max_total_time={seconds}', f'-max_len={LONGEST_INPUT}', '-timeout=20',
        f'-artifact_prefix={CORPUS / name}/broken-', '-verbosity=0', '-print_final_stats=1', '-rss_limit_mb=4096',
    ], target)
    atheris.Fuzz()


if __name__ == '__main__':
    main()
