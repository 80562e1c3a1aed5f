"""Pictures of plain arrays; knows no run."""
