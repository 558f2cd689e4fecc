"""policy/fly as a leaf of a behaviour tree of py_trees; a tree that turns elsewhere cancels the flight, and the drone holds."""

import py_trees
import rclpy
from py_trees.common import Status
from rclpy.action import ActionClient
from rclpy.signals import SignalHandlerOptions

from advise_msgs.action import Fly


class FlyPolicy(py_trees.behaviour.Behaviour):
    def initialise(self):
        self.ended = None
        self.sent = client.send_goal_async(Fly.Goal(start_cell=-1))
        self.sent.add_done_callback(lambda sent: setattr(self, 'ended', sent.result().get_result_async()))

    def update(self):
        if self.ended is None or not self.ended.done():
            return Status.RUNNING
        result = self.ended.result().result
        self.feedback_message = result.message if result.success else f'error {result.error_code}: {result.error_msg}'
        return Status.SUCCESS if result.success else Status.FAILURE

    def terminate(self, new_status):
        if new_status == Status.INVALID and not (self.ended and self.ended.done()):  # Also one that is not accepted yet.
            self.sent.add_done_callback(lambda sent: sent.result().cancel_goal_async())


rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
node = rclpy.create_node('mission')
client = ActionClient(node, Fly, 'policy/fly')
client.wait_for_server()
tree = py_trees.decorators.Timeout('in time', FlyPolicy('fly the policy'), duration=600.0)
try:
    while tree.status in (Status.INVALID, Status.RUNNING):
        tree.tick_once()
        rclpy.spin_once(node, timeout_sec=0.1)
except KeyboardInterrupt:
    tree.stop(Status.INVALID)
for _ in range(10):  # What was canceled goes out.
    rclpy.spin_once(node, timeout_sec=0.1)
print(tree.status.name, tree.decorated.feedback_message)
