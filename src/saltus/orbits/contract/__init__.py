"""What the equations of all orbits promise, and the events of a motion that they read."""
