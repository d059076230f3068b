//! The trajectory-generator service.
