//! Clocks for measurements: seconds from an arbitrary origin.

use std::time::SystemTime;

/// Wall time, to a quarter of a microsecond.
pub fn wall() -> f64 {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0.0, |time| time.as_secs_f64())
}

/// Processor time of all threads of this process, which other processes do not disturb; zero if the
/// system does not provide it (Linux does).
pub fn processor() -> f64 {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return 0.0 };
    tasks
        .filter_map(|task| std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok())
        .filter_map(|text| text.split_whitespace().next()?.parse::<f64>().ok())
        .sum::<f64>()
        * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One thread cannot compute for longer than the wall time; tests that run at the same time add
    /// to it.
    #[test]
    fn clocks_go_forward() {
        let (wall_before, processor_before) = (wall(), processor());
        let mut sum = 0u64;
        while wall() - wall_before < 0.02 {
            sum = std::hint::black_box(sum.wrapping_add(1));
        }
        assert!(processor() >= processor_before);
        assert!(!cfg!(target_os = "linux") || processor() > 0.0);
    }
}
