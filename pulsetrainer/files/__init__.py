"""HDF5 kinds and store, provenance, recorder and tables; knows nothing of physics."""
