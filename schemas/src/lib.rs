//! The wire contract of curionav: messages, their CBOR encoding, and their limits.
