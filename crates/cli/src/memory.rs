//! How much memory the machine can give.

/// Memory that the system can give without swapping; `None` where it does not tell. \[bytes\]
pub fn available() -> Option<f64> {
    parse(&std::fs::read_to_string("/proc/meminfo").ok()?)
}

/// The line `MemAvailable` of Linux' `/proc/meminfo`.
fn parse(text: &str) -> Option<f64> {
    let rest = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kilobytes: f64 = rest.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024.0 * kilobytes)
}

#[cfg(test)]
mod tests {
    use super::parse;

    /// As proc_meminfo(5) shows it.
    #[test]
    fn available_memory_is_read() {
        let text = "MemTotal:       24681856 kB\nMemFree:        22487532 kB\nMemAvailable:   24181720 kB\n";
        assert_eq!(parse(text), Some(24_181_720.0 * 1024.0));
        assert_eq!(parse("MemTotal: 1 kB\n"), None);
        assert_eq!(parse("MemAvailable: much\n"), None);
    }
}
