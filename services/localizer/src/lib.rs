//! The localizer service.
