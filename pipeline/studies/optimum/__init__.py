"""The study `optimum`: values of keys of a scene at which its worst motion is lowest."""
