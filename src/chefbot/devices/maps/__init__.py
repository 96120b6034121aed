"""Map server with its changes, and map recorder: the devices that have maps on the disk."""
