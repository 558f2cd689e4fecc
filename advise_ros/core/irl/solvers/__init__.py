"""Solvers of the program behind one call."""
