"""The program's own interior-point method."""
