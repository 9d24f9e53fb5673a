"""Members: other unfoldings of the same body that its coordinates allow as well."""
