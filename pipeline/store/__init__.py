"""The content store and the output folder that it lives in."""
