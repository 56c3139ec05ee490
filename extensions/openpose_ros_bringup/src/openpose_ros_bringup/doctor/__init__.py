"""Ten checks of a camera and the nodes that read it: facts in, findings out."""
