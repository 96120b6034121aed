"""Files of strangers by seed: valid samples, their mutants, and children with limits in which they are read."""
