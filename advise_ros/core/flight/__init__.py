"""Flying: from a position to a velocity, along legs, routes and whole missions."""
