"""The paper's evaluation (section 4): trials, statistics and figures."""
