"""Publishers, subscriptions, services and actions over Eclipse Zenoh, compatible with rmw_zenoh."""
