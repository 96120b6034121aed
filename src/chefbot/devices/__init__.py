"""Devices: drivers that connect a node graph to hardware, files and the terminal."""
