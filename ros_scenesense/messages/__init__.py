"""The messages of the graph: frozen structs, one module per topic family, and their JSON codec."""
