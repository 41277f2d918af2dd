"""From RGB-D images to point clouds, boxes and the table plane."""
