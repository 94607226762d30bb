"""Units and full scales of numbers, by physics, and questions about them."""
