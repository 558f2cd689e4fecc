"""Cheapest ways to a waypoint over the cells of a site, and their repair when a few cells change their price.

A way costs the sum of the prices of the cells that it enters, whole numbers, so that equal is equal. The repair is that of
Ramalingam & Reps (1996, "An incremental algorithm for a generalization of the shortest-path problem"): only cells whose
distance changes, and those beside them, are looked at.
"""

from __future__ import annotations

import numpy as np

from advise_ros.core.numerics import Ints
from advise_ros.core.site.compiled import compiled
from advise_ros.core.site.layout import Bytes, Int32s

FAR = 1 << 40
# A heap entry is the key, then the cell in this many bits.
CELL_BITS = 20
CELL_MASK = (1 << CELL_BITS) - 1
# Entries that a heap of n cells holds for certain: each settled cell adds at most four.
HEAP_PER_CELL, HEAP_SPARE = 8, 64


@compiled
def push(heap: Ints, size: int, key: int, cell: int) -> int:
    """Add an entry to a binary heap; returns the new size."""
    entry = (key << CELL_BITS) | cell
    at = size
    while at > 0:
        parent = (at - 1) >> 1
        if heap[parent] <= entry:
            break
        heap[at] = heap[parent]
        at = parent
    heap[at] = entry
    return size + 1


@compiled
def pop(heap: Ints, size: int) -> int:
    """Take the least entry off; returns it, the heap has then one entry less."""
    least, entry = heap[0], heap[size - 1]
    size -= 1
    at = 0
    while True:
        child = 2 * at + 1
        if child >= size:
            break
        if child + 1 < size and heap[child + 1] < heap[child]:
            child += 1
        if entry <= heap[child]:
            break
        heap[at] = heap[child]
        at = child
    heap[at] = entry
    return least


@compiled
def next_cost(moves: Int32s, price: Ints, distance: Ints, cell: int) -> int:
    """What the best move from a cell costs to the end, by the distances of the cells beside it."""
    best = FAR
    for action in range(4):
        there = moves[cell, action]
        if there >= 0:
            cost = distance[there] + price[there]
            best = min(best, cost)
    return best


@compiled
def distances_to(moves: Int32s, price: Ints, goal: int, distance: Ints, heap: Ints) -> None:
    """Fill in the distance (cells,) to a goal cell by Dijkstra's algorithm; FAR where there is no way.

    Args:
        moves: (cells, 4) cells that can be entered, -1 for none.
        price: (cells,) of entering each, whole and positive.
        goal: the cell.
        distance: (cells,) is written.
        heap: scratch, at least HEAP_PER_CELL * cells + HEAP_SPARE.
    """
    distance[:] = FAR
    distance[goal] = 0
    size = push(heap, 0, 0, goal)
    while size:
        entry = pop(heap, size)
        size -= 1
        cell, key = entry & CELL_MASK, entry >> CELL_BITS
        if key != distance[cell]:
            continue
        through = key + price[cell]
        for action in range(4):
            there = moves[cell, action]
            if there >= 0 and through < distance[there]:
                distance[there] = through
                size = push(heap, size, through, there)


@compiled
def costs_of(moves: Int32s, price: Ints, distance: Ints, cell: int, costs: Ints) -> int:
    """Fill in what each action (4,) costs to the end, FAR where it can't be made; returns the least."""
    best = FAR
    for action in range(4):
        there = moves[cell, action]
        costs[action] = FAR if there < 0 else distance[there] + price[there]
        best = min(best, costs[action])
    return best


@compiled
def all_distances(moves: Int32s, price: Ints, waypoints: Int32s) -> Ints:
    """(layers, cells) distance to each layer's waypoint.

    Args:
        moves: (cells, 4) cells that can be entered, -1 for none.
        price: (layers, cells) of entering each on the way to each waypoint; (cells,) or (1, cells): the same for all.
        waypoints: (layers,) cells.
    """
    prices = np.atleast_2d(price)
    n = prices.shape[1]
    distance = np.empty((len(waypoints), n), dtype=np.int64)
    heap = np.empty(HEAP_PER_CELL * n + HEAP_SPARE, dtype=np.int64)
    for layer in range(len(waypoints)):
        distances_to(moves, prices[layer if len(prices) > 1 else 0], waypoints[layer], distance[layer], heap)
    return distance


@compiled
def best_actions(moves: Int32s, price: Ints, distance: Ints) -> Bytes:
    """(layers * cells,) the actions that lie on a cheapest way, as a sum of 1 << action; 0 where there is none.

    Prices are as of `all_distances`.
    """
    prices = np.atleast_2d(price)
    layers, n = distance.shape
    best = np.zeros(layers * n, dtype=np.uint8)
    costs = np.empty(4, dtype=np.int64)
    for layer in range(layers):
        for cell in range(n):
            least = costs_of(moves, prices[layer if len(prices) > 1 else 0], distance[layer], cell, costs)
            if least >= FAR:
                continue
            for action in range(4):
                if costs[action] == least:
                    best[layer * n + cell] |= 1 << action
    return best


@compiled
def cheapest_sets(moves: Int32s, prices: Ints, waypoints: Int32s) -> Bytes:
    """(m, layers * cells) best actions under each of m prices (m, layers or 1, cells) of entering cells."""
    sets = np.empty((len(prices), len(waypoints) * prices.shape[2]), dtype=np.uint8)
    for row in range(len(prices)):
        sets[row] = best_actions(moves, prices[row], all_distances(moves, prices[row], waypoints))
    return sets


def optimal_sets(moves: Int32s, maps: Bytes, waypoints: Int32s, entry_price: int) -> Bytes:
    """(m, layers * cells) best actions under each of m maps (m, cells), entering a marked cell at `entry_price`."""
    return cheapest_sets(moves, np.where(maps > 0, entry_price, 1).astype(np.int64)[:, None], waypoints)
