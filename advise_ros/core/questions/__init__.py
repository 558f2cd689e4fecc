"""STATECLUSTERING, UNCERTAINTY and SELECTQUERY of algorithm 1, and the words of a question."""
