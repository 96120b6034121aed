"""Safety functions that limit or stop the wheels, as pure logic without an event loop."""
