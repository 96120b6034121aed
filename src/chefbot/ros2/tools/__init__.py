"""Verbs that look at the wire and take part in it, as ROS 2's own tools do: its nodes are seen like ours."""
