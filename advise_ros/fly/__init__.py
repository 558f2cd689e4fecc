"""`advise fly`: the whole graph around one vehicle, from one command."""
