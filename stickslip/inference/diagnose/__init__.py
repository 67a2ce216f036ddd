"""Which physical effect is missing: score, refit, held-out comparison, verdict."""
