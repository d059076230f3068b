//! The driver service.
