//! The hccdm-evaluator service.
