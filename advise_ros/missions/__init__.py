"""Missions and areas of other tools' files: read into a grid, and a learnt route written for them or sent to a vehicle."""
