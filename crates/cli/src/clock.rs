//! Clocks that measurements use: seconds from any origin.

use std::time::SystemTime;

/// Time as it passes, to a quarter of a microsecond.
pub fn wall() -> f64 {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0.0, |time| time.as_secs_f64())
}

/// Time that all threads of this process have spent computing, which other processes do not disturb; zero where the system
/// does not tell (Linux does).
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

    /// One thread cannot compute for longer than time passes; tests beside this one may.
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
