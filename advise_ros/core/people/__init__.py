"""The simulated pilot and the simulated expert of section 4, and a trial with them."""
