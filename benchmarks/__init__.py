"""What the README quotes, one figure a module: python -m benchmarks [name ...]."""
