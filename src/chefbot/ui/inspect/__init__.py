"""The ROS graph on the page: topics with rates, values and plots."""
