"""The study `wear`: contact faces that wear over a life, and what that does to the response."""
