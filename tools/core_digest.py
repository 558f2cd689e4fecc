"""Writes advise_ros/recording/kept_digest.py: the digest of core's code, which takes a node too long to make at its start.

    ./advise python tools/core_digest.py

After a change in advise_ros/core; until then it is made at each start. --check only compares.
"""

from __future__ import annotations

import sys
from pathlib import Path

from advise_ros.recording import code_digest

FILE = Path(code_digest.__file__).with_name('kept_digest.py')
TEXT = """\
\"\"\"The digest of core's code and a hash of the sources that it was made of. Made by tools/core_digest.py.\"\"\"

SOURCES = '{sources}'
DIGEST = '{digest}'
"""


def main() -> int:
    core = code_digest.CORE
    text = TEXT.format(sources=code_digest.hash_of_sources(core), digest=code_digest.digest_of_code(core))
    if '--check' in sys.argv:
        return int(FILE.read_text(encoding='utf-8') != text)
    FILE.write_text(text, encoding='utf-8')
    return 0


if __name__ == '__main__':
    sys.exit(main())
