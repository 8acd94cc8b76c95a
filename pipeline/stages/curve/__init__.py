"""Response curves: solved, carried to neighbours, stored, and summarised."""
