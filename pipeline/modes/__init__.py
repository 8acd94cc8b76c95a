"""Before the response: natural frequencies, crossings, static contact and a frequency range, in seconds."""
