"""Which measurement belongs to which track: likelihoods in, probabilities out."""
