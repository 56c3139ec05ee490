"""Points and cameras: organized clouds, depth images, pinhole models, recorded sequences."""
