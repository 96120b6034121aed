"""The node runtime: nodes and ports, event loop, clocks, actions, transforms, launch files, recordings."""
