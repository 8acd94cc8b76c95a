"""HDF5 files: reading what may be damaged, writing on disks that may be full; sectors, full and reduced models."""
