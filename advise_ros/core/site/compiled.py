"""How the hot loops are compiled: once, kept on disk, and without Python's interpreter lock.

While they run in a thread of their own, others go on: the executor answers services while the worker draws maps.
"""

from numba import njit

compiled = njit(cache=True, nogil=True)
