"""Publishers, subscriptions, services and actions by rmw_zenoh's protocol over Eclipse Zenoh."""
