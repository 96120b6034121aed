"""Graph SLAM."""
