"""Learns axioms from labelled examples, and forgets them (paper, *Decision Tree Induction ...*)."""
