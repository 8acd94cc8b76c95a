"""A scene to start from for a mesh of another program: what is in the file, a scene, a picture."""
