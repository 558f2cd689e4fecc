"""What a callback costs by rclpy's executor and by ours: processor time of a process with a node like ours.

    ./advise python benchmarks/executor.py [--rounds 5] [--seconds 5]

The two take turns, each in a process of its own, with a managed node and a timer of 200 Hz; the ratio counts.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import threading
import time

import numpy as np
import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.executors import SingleThreadedExecutor

from advise_ros.ros.executor import LeanExecutor
from advise_ros.ros.managed import ManagedNode

EXECUTORS = {"rclpy's": SingleThreadedExecutor, 'ours': LeanExecutor}
RATE_HZ = 200.0


def used_s() -> float:
    """Processor seconds of this process so far."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def cost_us(name: str, seconds: float) -> float:
    """Processor time of a callback, in this process."""
    calls = [0]
    rclpy.init(args=[])
    node = ManagedNode('measured')
    node.create_timer(1.0 / RATE_HZ, lambda: calls.append(0), clock=Clock(clock_type=ClockType.STEADY_TIME))
    executor = EXECUTORS[name]()
    executor.add_node(node)
    threading.Thread(target=executor.spin, daemon=True).start()
    time.sleep(1.0)
    before_s, before = used_s(), len(calls)
    time.sleep(seconds)
    return 1e6 * (used_s() - before_s) / (len(calls) - before)


def measured(name: str, seconds: float) -> float:
    """The same in a process of its own."""
    command = [sys.executable, __file__, '--one', name, '--seconds', str(seconds)]
    return float(subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout.split()[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--rounds', type=int, default=5)
    parser.add_argument('--seconds', type=float, default=5.0)
    parser.add_argument('--one', choices=list(EXECUTORS), help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        print(cost_us(given.one, given.seconds), flush=True)
        return
    costs = np.array([[measured(name, given.seconds) for name in EXECUTORS] for _ in range(given.rounds)])
    for name, mean in zip(EXECUTORS, costs.mean(axis=0), strict=True):
        print(f'{name}: {mean:.0f} us a callback')
    ratios = costs[:, 1] / costs[:, 0]
    half = 1.96 * ratios.std(ddof=1) / np.sqrt(len(ratios)) if len(ratios) > 1 else float('nan')
    print(f'ratio {ratios.mean():.2f} +- {half:.2f} (95 %, {len(ratios)} pairs)')


if __name__ == '__main__':
    main()
