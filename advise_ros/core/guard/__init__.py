"""The last check before the vehicle: limits, fence, late and doubtful positions, the way back inside."""
