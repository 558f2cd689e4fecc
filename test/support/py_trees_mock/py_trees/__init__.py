"""MOCK of py_trees, as little as examples/behaviour_tree.py takes; where py_trees is installed the test takes that."""

from py_trees import behaviour, common, decorators

__all__ = ['behaviour', 'common', 'decorators']
