"""The bridge's process over a link that loses, delays and reorders, and is cut."""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import PoseStamped, TwistStamped
from std_srvs.srv import Trigger

from advise_msgs.msg import VehicleStatus
from advise_ros.ros import qos
from support.flying import velocity
from support.graph import Graph
from support.lossy import LossyProxy


def test_flies_through_losses_and_stands_when_the_link_is_cut(graph: Graph, free_udp_port: int) -> None:
    def wait_status(wanted: Any, **given: Any) -> VehicleStatus:
        return graph.wait_for('vehicle_status', VehicleStatus, wanted, qos=qos.latched(), **given)

    with LossyProxy(free_udp_port, 4, loss=0.3, delay_s=0.05, jitter_s=0.1) as proxy:
        graph.start('simulator', params={'endpoint': f'udpout:127.0.0.1:{proxy.vehicle_port}', 'ready_after_s': 1.0})
        graph.start('mavlink_bridge', params={
            'url': f'udpin:127.0.0.1:{free_udp_port}', 'takeoff_altitude_m': 2.0, 'fence': 'off',
        })
        wait_status(lambda s: s.ready)
        assert graph.call(Trigger, 'mavlink_bridge/takeoff').success
        wait_status(lambda s: s.commandable)
        commands = graph.publisher('cmd_vel', TwistStamped, qos.COMMAND)
        poses = graph.listen('pose', PoseStamped, qos.SENSOR_DEEP)

        def east_of(metres: float) -> Any:
            commands.publish(velocity(1.0, 0.0))
            return poses and poses[-1].pose.position.x > metres

        graph.wait_until(lambda: east_of(1.0), what='1 m east')
        proxy.cut(True)
        wait_status(lambda s: not s.connected, new=True)
        proxy.cut(False)
        wait_status(lambda s: s.commandable, new=True)
        # Nothing was commanded meanwhile: GUID_TIMEOUT has braked it, and what was asked before does not come back.
        poses.clear()

        def stands() -> bool:
            return len(poses) > 20 and abs(poses[-1].pose.position.x - poses[-10].pose.position.x) < 0.05

        graph.wait_until(stands, what='a vehicle that stands')
        graph.wait_until(lambda: east_of(poses[0].pose.position.x + 1.0), what='1 m further east')
