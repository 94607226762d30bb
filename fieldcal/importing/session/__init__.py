"""From samples to a session folder: validated, merged, written whole."""
