"""Motors, driver, battery and stability of a robot, calculated."""
