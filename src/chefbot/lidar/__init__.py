"""Serial protocols of lidars: bytes to revolutions of samples, and back for emulators, without input or output."""
