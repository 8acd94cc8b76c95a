"""A scene whose knobs are turned: the response at once, then views of it that are ever surer."""
