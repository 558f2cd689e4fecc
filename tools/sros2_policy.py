"""Write config/sros2/policy.xml: what each node may publish, hear, serve and ask, for DDS Security.

    ./advise python tools/sros2_policy.py

A test compares the table below with the running graph: a node that needs more, or has more, fails it.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import NamedTuple

TARGET = Path(__file__).parents[1] / 'config' / 'sros2' / 'policy.xml'
ENCLAVES = '/advise_ros'
HEAD = '<!-- Written by tools/sros2_policy.py; docs/safety.md tells how to use it. For a namespace change every ns. -->\n'

PARAMETER_SERVICES = tuple(f'~{name}' for name in (
    'describe_parameters', 'get_parameter_types', 'get_parameters', 'get_type_description', 'list_parameters',
    'set_parameters', 'set_parameters_atomically',
))
LEARNT = ('advise/policy', 'advise/query', 'advise/status', 'advise/advice_log')
PICTURES = tuple(
    f'advise/{name}' for name in ('uncertainty', 'reward', 'site_map', 'site_prior', 'markers', 'route', 'map')
)
SHOWN = ('recorder/path', 'recorder/track', 'guard/cmd_vel', 'guard/pose', 'advise/geo_route')
FLOWN = ('pose', 'cmd_vel', 'vehicle_status')
SESSION = (*FLOWN, 'odom', 'battery_state', 'demonstration', *LEARNT, *PICTURES, 'policy/status', 'diagnostics')
ANSWERING = tuple(f'advise/{name}' for name in ('answer', 'preview', 'undo', 'retract'))
VEHICLE = tuple(f'mavlink_bridge/{name}' for name in ('arm', 'takeoff', 'land', 'take_over', 'stop', 'release'))
RECORDING = tuple(f'recorder/{name}' for name in ('start', 'stop', 'discard'))
TEACHING = (*RECORDING, 'recorder/take_back')
GUARD = ('guard/stop', 'guard/release')
# Whatever version of its message each has.
PX4_READS = tuple(f'fmu/in/{name}*' for name in ('offboard_control_mode', 'trajectory_setpoint', 'vehicle_command'))
PX4_SAYS = tuple(f'fmu/out/{name}*' for name in (
    'battery_status', 'vehicle_command_ack', 'vehicle_land_detected', 'vehicle_local_position', 'vehicle_odometry',
    'vehicle_status',
))
LIFE_CYCLE = ('change_state', 'get_state', 'get_available_states', 'get_available_transitions', 'get_transition_graph')


def of(node: str, names: tuple[str, ...]) -> tuple[str, ...]:
    """Names below a node's own."""
    return tuple(f'{node}/{name}' for name in names)


class Grants(NamedTuple):
    """Names, relative to the namespace, beside those that every node has.

    Attributes:
        node: its name, where that is not the enclave's.
    """

    publish: tuple[str, ...] = ()
    subscribe: tuple[str, ...] = ()
    reply: tuple[str, ...] = ()
    request: tuple[str, ...] = ()
    execute: tuple[str, ...] = ()
    call: tuple[str, ...] = ()
    node: str = ''


BRIDGE = Grants(
    ('pose', 'battery_state', 'vehicle_status', 'mavlink_bridge/transition_event'), ('cmd_vel',),
    (*VEHICLE, *of('mavlink_bridge', LIFE_CYCLE)),
)

GRANTS: dict[str, Grants] = {
    'simulator': Grants(publish=('clock',)),
    'mavlink_bridge': BRIDGE,
    # The same on PX4's topics, where others than it must not write.
    'mavlink_bridge_px4_dds': BRIDGE._replace(
        publish=(*BRIDGE.publish, *PX4_READS), subscribe=(*BRIDGE.subscribe, *PX4_SAYS), node='mavlink_bridge',
    ),
    'guard': Grants(
        ('guard/cmd_vel', 'guard/pose', 'guard/transition_event'), ('cmd_vel', 'pose'), (*GUARD, *of('guard', LIFE_CYCLE)),
    ),
    'recorder': Grants(
        ('demonstration', 'recorder/path', 'recorder/track'),
        (*FLOWN, 'odom', 'policy/status', 'demonstration', 'advise/status'), TEACHING,
    ),
    'advise': Grants((*LEARNT, *PICTURES, 'advise/geo_route', 'demonstration'), ('demonstration',), ANSWERING),
    'policy': Grants(
        ('cmd_vel', 'policy/status', 'policy/transition_event'), ('advise/policy', 'vehicle_status', 'pose'),
        ('policy/stop', *of('policy', LIFE_CYCLE)), execute=('policy/fly',),
    ),
    'logger': Grants((), (*SESSION, *SHOWN), request=('*/list_parameters', '*/get_parameters')),
    'pilot': Grants(('cmd_vel', 'pilot/status'), ('vehicle_status', 'pose', 'diagnostics'), (), (*VEHICLE, 'recorder/stop')),
    'expert': Grants((), ('advise/query',), (), ('advise/answer',)),
    'console': Grants(
        ('cmd_vel',), SESSION, (), (*ANSWERING, *TEACHING, 'policy/stop', *VEHICLE, 'advise/get_parameters'),
        call=('policy/fly',),
    ),
    'teleop': Grants(('cmd_vel',), ('vehicle_status', 'pose', 'joy'), (), (*VEHICLE, *RECORDING)),
    # A person with the ros2 command.
    'operator': Grants(
        (), (*SESSION, *SHOWN, '*/transition_event'), (),
        (*ANSWERING, *TEACHING, *VEHICLE, *GUARD, 'policy/stop', '*/get_parameters', '*/list_parameters', *of('*', LIFE_CYCLE)),
        call=('policy/fly',),
    ),
}


def policy() -> ET.Element:
    """The policy of all enclaves."""
    root = ET.Element('policy', version='0.2.0')
    contexts = ET.SubElement(root, 'contexts')
    for enclave, grants in GRANTS.items():
        context = ET.SubElement(contexts, 'context', path=f'{ENCLAVES}/{enclave}')
        profile = ET.SubElement(ET.SubElement(context, 'profiles'), 'profile', ns='/', node=grants.node or enclave)
        _allow(profile, 'action', 'call', grants.call)
        _allow(profile, 'action', 'execute', grants.execute)
        _allow(profile, 'service', 'reply', (*PARAMETER_SERVICES, *grants.reply))
        _allow(profile, 'service', 'request', grants.request)
        _allow(profile, 'topic', 'publish', ('rosout', 'parameter_events', 'diagnostics', *grants.publish))
        _allow(profile, 'topic', 'subscribe', ('parameter_events', 'clock', *grants.subscribe))
    return root


def _allow(profile: ET.Element, kind: str, right: str, names: tuple[str, ...]) -> None:
    if names:
        group = ET.SubElement(profile, f'{kind}s', {right: 'ALLOW'})
        for name in sorted(set(names)):
            ET.SubElement(group, kind).text = name


def text() -> str:
    """The file."""
    root = policy()
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{HEAD}{ET.tostring(root, encoding="unicode")}\n'


if __name__ == '__main__':
    TARGET.write_text(text())
