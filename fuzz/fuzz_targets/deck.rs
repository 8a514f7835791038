#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| slipstick_fuzz::targets::deck(data));
