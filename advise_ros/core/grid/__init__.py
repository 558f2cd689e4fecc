"""The grid and the rule that turns positions into cells of it."""
