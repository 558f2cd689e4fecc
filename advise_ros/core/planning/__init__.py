"""Decision processes and planning on them; the way along a route, and flying it on paper."""
