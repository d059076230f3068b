//! The cpc-evaluator service.
