"""Times of samples: of rows, of a clock as text, of a FIFO, of two sensors."""
