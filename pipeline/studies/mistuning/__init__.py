"""The study `mistuning`: rings whose blades and contact pairs differ, and the amplification of the tuned response."""
