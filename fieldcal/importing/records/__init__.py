"""Records of JSON as rows."""
