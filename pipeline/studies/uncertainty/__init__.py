"""The study `uncertainty`: distribution of the worst motion for uncertain parameters."""
