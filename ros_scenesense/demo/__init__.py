"""The guided run: watches the graph look at scenes, shows it live, and writes a report."""
