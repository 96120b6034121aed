"""The ROS graph in the web UI: topics with rates, values and plots."""
