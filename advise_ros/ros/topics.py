"""The topics that a session is rebuilt from, as the design names them."""

from __future__ import annotations

from rclpy.qos import QoSProfile

from advise_ros.ros import qos

# Relative name -> message type and the profile of a reader that must miss nothing.
RECORDED: dict[str, tuple[str, QoSProfile]] = {
    'pose': ('geometry_msgs/msg/PoseStamped', qos.SENSOR_DEEP),
    'odom': ('nav_msgs/msg/Odometry', qos.SENSOR_DEEP),
    'cmd_vel': ('geometry_msgs/msg/TwistStamped', qos.COMMAND_DEEP),
    'vehicle_status': ('advise_msgs/msg/VehicleStatus', qos.latched(100)),
    'battery_state': ('sensor_msgs/msg/BatteryState', qos.SENSOR_DEEP),
    'demonstration': ('advise_msgs/msg/Demonstration', qos.DEMONSTRATIONS),
    'advise/query': ('advise_msgs/msg/AdviceQuery', qos.latched(100)),
    'advise/policy': ('advise_msgs/msg/Policy', qos.latched(100)),
    'advise/advice_log': ('advise_msgs/msg/Advice', qos.ADVICE_LOG),
    'advise/status': ('advise_msgs/msg/LearnerStatus', qos.latched(100)),
    'advise/uncertainty': ('nav_msgs/msg/OccupancyGrid', qos.latched(100)),
    'advise/reward': ('nav_msgs/msg/OccupancyGrid', qos.latched(100)),
    'advise/site_map': ('nav_msgs/msg/OccupancyGrid', qos.latched(100)),
    'advise/site_prior': ('std_msgs/msg/String', qos.latched(100)),
    'advise/markers': ('visualization_msgs/msg/MarkerArray', qos.latched(100)),
    'advise/route': ('nav_msgs/msg/Path', qos.latched(100)),
    'advise/map': ('nav_msgs/msg/OccupancyGrid', qos.latched()),
    'recorder/path': ('nav_msgs/msg/Path', qos.DEMONSTRATIONS),
    'recorder/track': ('visualization_msgs/msg/Marker', qos.latched(100)),
    'guard/cmd_vel': ('geometry_msgs/msg/TwistStamped', qos.COMMAND_DEEP),
    'guard/pose': ('geometry_msgs/msg/PoseStamped', qos.SENSOR_DEEP),
    'policy/status': ('advise_msgs/msg/FlightStatus', qos.latched(1000)),
    '/parameter_events': ('rcl_interfaces/msg/ParameterEvent', qos.COMMAND_DEEP),
    '/diagnostics': ('diagnostic_msgs/msg/DiagnosticArray', qos.COMMAND_DEEP),
}

# What the session's services publish of their calls, once someone has turned that on (parameter service_introspection).
SERVING = ('advise', 'recorder', 'policy', 'mavlink_bridge', 'guard')
# Recorded once somebody publishes it: its package is not among those that are always there.
PUBLISHED_AT_TIMES = ('advise/geo_route',)
RECORDED_PATTERNS = (*PUBLISHED_AT_TIMES, *(f'{node}/*/_service_event' for node in SERVING))
