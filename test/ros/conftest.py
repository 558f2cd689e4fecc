"""Tests against real processes in a private ROS graph.

Run them in the built environment: `make test`, or `./advise python -m pytest test/ros -k NAME`.

`graph` gives each test a ROS domain of its own (locked on this machine, so that runs side by side and
`pytest -n` are fine; ADVISE_TEST_DOMAINS=10-19 restricts the choice), reachable from this machine only:

    def test_pose(graph, free_udp_port):
        bridge = graph.start('mavlink_bridge', params={'url': f'udpin:127.0.0.1:{free_udp_port}', 'fence': 'off'})
        pose = graph.wait_for('pose', PoseStamped, lambda p: p.pose.position.z > 1, qos=qos.SENSOR)
        reply = graph.call(Trigger, 'mavlink_bridge/land')
        assert bridge.terminate() == 0

- `graph.start(name, params, remaps, env, args, namespace)` -> Process: `.out`, `.err`, `.text`,
  `.wait_exit()`, `.terminate()`, `.signal(SIGINT)`, `.kill()`, `.running`. Do not parse `.out`: the
  middleware writes there too. It is a real process with its own DDS participant, signals and exit code; its imports are
  done once for all, as it is forked from a process that has imported what its executable imports
  (support/fork_server.py). Who tests imports, the start, memory or what /proc says of it has it begin from nothing:
  `graph.start_fresh(name, params, ...)`. test_graph_fixture.py does so for each executable.
- `graph.run(name, *args)` the same, and waits for its end: look at `.popen.returncode`.
- `graph.wait_for(topic, type, predicate, qos, timeout_s, new)` the first message that fits, of all heard
  since the first `listen` / `wait_for` on that topic (`new=True`: only of those to come).
- `graph.listen(topic, type, qos)` the growing list of messages.
- `graph.publisher(topic, type, qos)` a publisher that has a reader; `graph.call(srv, name, request)`;
  `graph.send_goal(action, name, goal, feedback)` and `graph.result(handle)`; `graph.wait_until(condition)`.
- `graph.node` is the test's own rclpy node, spinning in a background thread.

Nothing sleeps: every wait ends with its condition, and fails with the last lines of all processes
after its limit, or at once when a process ends with an exit code other than 0 that nobody waited for.
At the end everything is stopped by SIGINT; a process that does not stop, or leaves children, fails the test.
"""

from support.fixtures import announcements, forks, free_tcp_port, free_udp_port, graph, ros_env, square_file

__all__ = ['announcements', 'forks', 'free_tcp_port', 'free_udp_port', 'graph', 'ros_env', 'square_file']
