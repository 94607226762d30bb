"""Changes of the tables, the oldest first by `down_revision`."""
