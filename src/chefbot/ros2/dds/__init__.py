"""A bridge to ROS 2 installations on DDS: CDR bytes pass unchanged between Zenoh and Cyclone DDS.

Needs the extra `chefbot[dds]`; outside this package only `chefbot topic bridge` imports it.
"""
