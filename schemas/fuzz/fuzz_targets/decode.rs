//! Any bytes, read as each message: no panic, and what is accepted is written and read back unchanged.

#![no_main]

use curionav_schemas::{MESSAGES, recode};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    for message in MESSAGES {
        if let Some(Ok(written)) = recode(message.name, bytes, None) {
            let again = recode(message.name, &written, Some(message.encoding));
            assert_eq!(again, Some(Ok(written)), "{}", message.name);
        }
    }
});
