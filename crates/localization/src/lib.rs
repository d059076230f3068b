//! Pure adaptive Monte Carlo localisation (AMCL).
