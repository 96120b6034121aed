"""Message types with the names and fields of ROS 2, and their CDR serialization."""
