"""A client of one's own, by advise_msgs alone, lets the drone fly its policy; Ctrl-C cancels, and the drone holds."""

import sys

import rclpy
from rclpy.action import ActionClient
from rclpy.signals import SignalHandlerOptions

from advise_msgs.action import Fly

# Ctrl-C is ours: rclpy's own handler would end ROS before the goal is canceled.
rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
node = rclpy.create_node('fly_client')
client = ActionClient(node, Fly, 'policy/fly')
client.wait_for_server()
handle = None
try:
    sent = client.send_goal_async(Fly.Goal(start_cell=-1), lambda message: print('state', message.feedback.state, flush=True))
    rclpy.spin_until_future_complete(node, sent)
    handle = sent.result()
    ended = handle.get_result_async()
    while not ended.done():
        rclpy.spin_once(node, timeout_sec=0.1)
except KeyboardInterrupt:
    if handle is not None:
        rclpy.spin_until_future_complete(node, handle.cancel_goal_async(), timeout_sec=5.0)
    sys.exit('canceled: the drone holds')
result = ended.result().result
print(result.message)
sys.exit(0 if result.success else f'error {result.error_code}: {result.error_msg}')
