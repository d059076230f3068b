//! The arbiter service.
