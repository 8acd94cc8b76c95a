"""Peaks of the response followed over a parameter of the contact or the load, with derivatives and the optimum."""
