"""Mathematics that knows no geometry."""
