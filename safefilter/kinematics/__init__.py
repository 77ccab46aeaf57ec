"""What velocities a robot can take, and the last word on what it executes."""
