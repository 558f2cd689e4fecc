"""What flies speaks DDS by UDP alone: what another process does to itself must not stop it.

The shared memory of Fast DDS has locks that all processes of a domain take. A process that is stopped, or killed, while it
holds one keeps every other that publishes waiting, for 0.3 to 1.9 s in our trials (docs/safety.md), and a bridge that
waits commands nothing, not even zero velocity. (eProsima/Fast-DDS issues 1144 and 5469 describe others.) All other
nodes keep what ROS gives them: shared memory loses nothing in a burst, as UDP does.

This runs before ROS is read, so it takes the standard library only.
"""

from __future__ import annotations

from collections.abc import MutableMapping
from pathlib import Path

RANGE, PROFILES, TRANSPORTS = 'ROS_AUTOMATIC_DISCOVERY_RANGE', 'FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_BUILTIN_TRANSPORTS'
FLYING = frozenset({'mavlink_bridge', 'guard', 'policy', 'pilot', 'teleop', 'simulator', 'console'})
LOOPBACK = Path(__file__).with_name('middleware_loopback.xml')


def without_shared_memory(environment: MutableMapping[str, str]) -> None:
    """Have nodes that begin with this environment use no shared memory; where they are found stays as it was.

    With LOCALHOST the ROS side of Fast DDS adds shared memory whatever else is said, so a profile that knows nothing
    but this machine's loopback takes its place. An environment with transports or profiles of its own is left as it is.
    """
    if environment.get(PROFILES, '') not in ('', str(LOOPBACK)):
        return
    if environment.get(RANGE) == 'LOCALHOST':
        environment.update({RANGE: 'SUBNET', PROFILES: str(LOOPBACK)})
    if not environment.get(TRANSPORTS):
        environment[TRANSPORTS] = 'UDPv4'
