"""Wire formats: pure codecs, bytes in and samples out, one a file."""
