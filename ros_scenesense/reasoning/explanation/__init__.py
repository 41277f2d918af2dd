"""Why a literal is in an answer set, or why not: proofs, failures, and their words and drawings."""
