"""The study `map`: worst motion over a grid of two keys, its contact states, jumps and lowest point."""
