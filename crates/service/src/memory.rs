//! The memory that requests may use, and that of this process.

use std::fs::read_to_string;
use std::path::Path;

/// The memory that requests may use, in total. \[bytes\]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Budget(Option<f64>);

impl Budget {
    /// This much.
    pub fn of(bytes: f64) -> Self {
        Self(Some(bytes))
    }

    /// What is [available] now; no bound if the system does not say.
    pub fn of_machine() -> Self {
        Self(available())
    }

    /// The budget, if `needed` exceeds it.
    pub fn exceeded_by(self, needed: f64) -> Option<f64> {
        self.0.filter(|&budget| needed > budget)
    }
}

/// Total memory available to this process: what it already uses plus what the system can provide
/// without swapping, within the limits on its address space (`ulimit -v`) and of its control groups
/// (containers). `None` if unknown. \[bytes\]
pub fn available() -> Option<f64> {
    let status = read_to_string("/proc/self/status").ok()?;
    let of_machine = parse(&read_to_string("/proc/meminfo").ok()?, "MemAvailable:");
    let of_addresses = || address_space(&read_to_string("/proc/self/limits").ok()?, &status);
    let of_groups = || control_groups(&read_to_string("/proc/self/cgroup").ok()?, Path::new("/sys/fs/cgroup"));
    let left = [of_machine, of_addresses(), of_groups()].into_iter().flatten().reduce(f64::min)?;
    Some(left + parse(&status, "VmRSS:").unwrap_or(0.0))
}

/// Peak memory of this process; `None` if the system does not provide it. \[bytes\]
pub fn peak() -> Option<f64> {
    parse(&read_to_string("/proc/self/status").ok()?, "VmHWM:")
}

/// A number of bytes with a unit.
pub fn bytes(value: f64) -> String {
    let (scaled, unit) = match value {
        v if v < 1e6 => (v / 1e3, "kB"),
        v if v < 1e9 => (v / 1e6, "MB"),
        v if v < 1e12 => (v / 1e9, "GB"),
        v => (v / 1e12, "TB"),
    };
    format!("{scaled:.1} {unit}")
}

/// A line of Linux' `/proc/meminfo` or `/proc/self/status`.
fn parse(text: &str, name: &str) -> Option<f64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(name))?;
    let kilobytes: f64 = rest.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024.0 * kilobytes)
}

/// What remains of the soft limit on the address space in `/proc/self/limits`; `None` if it is
/// unlimited.
fn address_space(limits: &str, status: &str) -> Option<f64> {
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    let limit: f64 = line.split_whitespace().next()?.parse().ok()?;
    Some((limit - parse(status, "VmSize:").unwrap_or(0.0)).max(0.0))
}

/// What remains of the tightest limit of the control groups (version 2) in `/proc/self/cgroup`;
/// `None` without a limit. File contents in memory that can be dropped do not count as used.
fn control_groups(groups: &str, root: &Path) -> Option<f64> {
    let group = groups.lines().find_map(|line| line.strip_prefix("0::/"))?;
    let left = |folder: &Path| {
        let number = |name: &str| read_to_string(folder.join(name)).ok()?.trim().parse::<f64>().ok();
        let (limit, used) = (number("memory.max")?, number("memory.current")?);
        let droppable = read_to_string(folder.join("memory.stat")).ok().and_then(|stat| {
            stat.lines().find_map(|line| line.strip_prefix("inactive_file "))?.trim().parse::<f64>().ok()
        });
        Some((limit - used + droppable.unwrap_or(0.0)).max(0.0))
    };
    // In a container, there may be no folder with the group's own name.
    root.join(group).ancestors().take_while(|folder| folder.starts_with(root)).filter_map(left).reduce(f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_are_short() {
        assert_eq!((bytes(2.5e3), bytes(3.26e9)), ("2.5 kB".into(), "3.3 GB".into()));
    }

    /// As proc_meminfo(5) shows it.
    #[test]
    fn available_memory_is_read() {
        let text = "MemTotal:       24681856 kB\nMemFree:        22487532 kB\nMemAvailable:   24181720 kB\n";
        assert_eq!(parse(text, "MemAvailable:"), Some(24_181_720.0 * 1024.0));
        assert_eq!(parse("MemTotal: 1 kB\n", "MemAvailable:"), None);
        assert_eq!(parse("VmHWM: much\n", "VmHWM:"), None);
    }

    /// As proc_pid_limits(5) shows it.
    #[test]
    fn the_limit_of_the_address_space_is_read() {
        let limits = |soft: &str| {
            format!("Limit   Soft Limit  Hard Limit  Units\nMax address space   {soft}   unlimited   bytes\n")
        };
        assert_eq!(address_space(&limits("unlimited"), "VmSize:  1 kB\n"), None);
        assert_eq!(address_space(&limits("1048576"), "VmSize:\t  24 kB\n"), Some(1_024_000.0));
        assert_eq!(address_space(&limits("1024"), "VmSize:  24 kB\n"), Some(0.0));
    }

    /// According to the Linux kernel's documentation of control groups, `memory.max` is `max`
    /// without a limit, and also applies to all groups below.
    #[test]
    fn the_tightest_control_group_counts() {
        let folder = tempfile::tempdir().expect("a folder");
        let root = folder.path();
        let inner = root.join("outer/inner");
        std::fs::create_dir_all(&inner).expect("made");
        let write = |folder: &Path, name: &str, text: &str| std::fs::write(folder.join(name), text).expect("written");
        write(&inner, "memory.max", "max\n");
        write(&inner, "memory.current", "5000\n");
        assert_eq!(control_groups("0::/outer/inner\n", root), None);
        write(&root.join("outer"), "memory.max", "10000\n");
        write(&root.join("outer"), "memory.current", "6000\n");
        assert_eq!(control_groups("0::/outer/inner\n", root), Some(4000.0));
        write(&root.join("outer"), "memory.stat", "anon 5000\ninactive_file 500\n");
        assert_eq!(control_groups("1:name=systemd:/x\n0::/outer/inner\n", root), Some(4500.0));
        write(&inner, "memory.max", "5001\n");
        assert_eq!(control_groups("0::/outer/inner\n", root), Some(1.0));
        assert_eq!(control_groups("0::/\n", root), None);
    }
}
