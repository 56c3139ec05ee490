"""Several cameras, one set of people: fusion of skeletons, triangulation and calibration from people."""
