"""Recordings of others made into sessions, one format a file."""
