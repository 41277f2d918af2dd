"""From the axioms of a task to regions of the image, and the networks that are trained on these."""
