"""Serial protocols of lidars: bytes to turns of samples, and back for emulators. No input or output of its own."""
