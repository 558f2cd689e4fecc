"""From samples of a flight to demonstrations, live and from recordings by one implementation."""
