"""Which hand suits a job: a search over a family of hands, and what confirms its best."""
