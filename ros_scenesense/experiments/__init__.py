"""The experiments of the paper, and the data that they are run on."""
