"""Recovery behaviors: motions and their sequence when the robot is blocked."""
