"""Nodes of the test process are found at once.

A node that starts beside one that has run for a while is found at once or, as often, with that one's next announcement,
which Fast DDS sends every 3 s: in most tests nobody did anything but wait for it. So the test's own nodes announce themselves
more often. What tests start announces itself as it does for everybody.
"""

from __future__ import annotations

from pathlib import Path

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from advise_ros.middleware import PROFILES

OFTEN = Path(__file__).with_suffix('.xml')


def announce_often(domain_id: int) -> None:
    """Have all nodes of this process announce themselves often; nodes that it starts in processes of their own do not.

    Fast DDS reads its profiles once, for a process's first node: this is to be the first.

    Args:
        domain_id: in which nobody else listens.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(PROFILES, str(OFTEN))
        context = Context()
        rclpy.init(args=[], context=context, domain_id=domain_id, signal_handler_options=SignalHandlerOptions.NO)
        Node('first', context=context, enable_rosout=False, start_parameter_services=False).destroy_node()
        context.try_shutdown()
