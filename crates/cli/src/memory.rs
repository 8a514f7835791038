//! How much memory the machine can give.

/// Memory that the system can give without swapping; `None` where it does not tell. \[bytes\]
pub fn available() -> Option<f64> {
    parse(&std::fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:")
}

/// Most memory that this process has had; `None` where the system does not tell. \[bytes\]
pub fn peak() -> Option<f64> {
    parse(&std::fs::read_to_string("/proc/self/status").ok()?, "VmHWM:")
}

/// A line of Linux' `/proc/meminfo` or `/proc/self/status`.
fn parse(text: &str, name: &str) -> Option<f64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(name))?;
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
        assert_eq!(parse(text, "MemAvailable:"), Some(24_181_720.0 * 1024.0));
        assert_eq!(parse("MemTotal: 1 kB\n", "MemAvailable:"), None);
        assert_eq!(parse("VmHWM: much\n", "VmHWM:"), None);
    }
}
