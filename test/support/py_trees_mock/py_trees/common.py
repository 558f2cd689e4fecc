"""MOCK: see the package."""

from enum import Enum


class Status(Enum):
    SUCCESS = 'SUCCESS'
    FAILURE = 'FAILURE'
    RUNNING = 'RUNNING'
    INVALID = 'INVALID'
