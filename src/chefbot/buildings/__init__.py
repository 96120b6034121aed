"""Generated buildings: a kind, a seed and a few numbers give a world file whose places a robot can reach."""
