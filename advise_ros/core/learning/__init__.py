"""ADVISE, algorithm 1: demonstrations and answers in, policy and next question out."""
