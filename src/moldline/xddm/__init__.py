"""SERVE: XDDM documents, and answers to a design framework."""
