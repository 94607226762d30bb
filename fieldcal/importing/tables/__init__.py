"""A recording in columns: what each is, its times, and tables of means."""
