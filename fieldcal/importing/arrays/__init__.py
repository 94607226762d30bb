"""Arrays with names: MATLAB, HDF5, NumPy."""
