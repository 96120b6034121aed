"""A bridge to installations of ROS 2 that speak DDS: CDR bytes pass unchanged between Zenoh and Cyclone DDS.

Needs the extra `chefbot[dds]`; nothing outside this package imports it but `chefbot dds`.
"""
