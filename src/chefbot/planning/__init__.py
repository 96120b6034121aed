"""Global path planning on a costmap."""
