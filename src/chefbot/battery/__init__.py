"""What the battery still allows: charge, consumption, and when to warn, to go home and to park.

monitor = BatteryMonitor(BatteryPack.of(robot, energy), BatteryParams(), prior)
monitor.update(Reading(time=12.5, voltage=12.9, current=math.nan, distance=0.1, moving=0.5))
monitor.assessment.level                                    # BatteryLevel.OK
"""
