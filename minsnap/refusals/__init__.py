"""Why there is no plan: proofs that no curve fits, and the sentences that say so."""
