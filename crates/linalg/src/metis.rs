//! Nested dissection and partitions by METIS: Karypis and Kumar, SIAM J. Sci. Comput. 20 (1998).

use std::sync::Mutex;

/// Seed of METIS' random numbers.
const SEED: i32 = 20_011;

/// METIS draws from the random numbers of the C library, which all threads share: two calls at
/// the same time would disturb each other and no longer be reproducible.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// The signal by which batch systems ask a process to end: `SIGTERM` on all platforms.
const TERMINATE: std::ffi::c_int = 15;

// SAFETY: the C library's function, with the arguments that the C standard gives it.
unsafe extern "C" {
    safe fn raise(signal: std::ffi::c_int) -> std::ffi::c_int;
}

/// Calls METIS. While it runs, METIS catches the signal to terminate the process and returns an error.
/// It is then called once more; if that succeeds, the error was such a signal, which is raised again
/// for the program's own handler.
fn undisturbed(mut call: impl FnMut() -> metis_sys::rstatus_et) -> Result<(), metis_sys::rstatus_et> {
    let guard = ONE_AT_A_TIME.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let first = call();
    let status = if first == metis_sys::rstatus_et_METIS_ERROR { call() } else { first };
    if status != metis_sys::rstatus_et_METIS_OK {
        return Err(status);
    }
    if first != status {
        raise(TERMINATE);
    }
    // only now, so that no other call to METIS catches this signal as well
    drop(guard);
    Ok(())
}

/// Vertices of a symmetric graph without loops in elimination order; `weights` are their numbers of
/// unknowns.
pub(crate) fn nested_dissection(
    mut offsets: Vec<i32>,
    mut neighbours: Vec<i32>,
    mut weights: Vec<i32>,
) -> Result<Vec<i32>, String> {
    let mut count = weights.len() as i32;
    let mut order = vec![0i32; weights.len()];
    let mut position = vec![0i32; weights.len()];
    let mut options = [0i32; metis_sys::METIS_NOPTIONS as usize];
    // SAFETY: `options` has METIS_NOPTIONS items; offsets and neighbours form a valid symmetric
    // graph without loops; the other arrays have one item per vertex. METIS keeps no pointer.
    undisturbed(|| unsafe {
        metis_sys::METIS_SetDefaultOptions(options.as_mut_ptr());
        options[metis_sys::moptions_et_METIS_OPTION_SEED as usize] = SEED;
        metis_sys::METIS_NodeND(
            &mut count,
            offsets.as_mut_ptr(),
            neighbours.as_mut_ptr(),
            weights.as_mut_ptr(),
            options.as_mut_ptr(),
            order.as_mut_ptr(),
            position.as_mut_ptr(),
        )
    })
    .map(|()| order)
    .map_err(|status| format!("METIS ordering failed with status {status}"))
}

/// Divides a symmetric graph without loops into parts: one of `parts` for every vertex, with about
/// the same sum of `weights`, and a small sum of `ties` between vertices of different parts. `ties`
/// has one entry per neighbour.
///
/// # Errors
/// If METIS cannot divide the graph, or the lengths of its arrays are inconsistent.
pub fn partition_graph(
    mut offsets: Vec<i32>,
    mut neighbours: Vec<i32>,
    mut weights: Vec<i32>,
    mut ties: Vec<i32>,
    parts: usize,
) -> Result<Vec<u32>, String> {
    let vertices = weights.len();
    let whole = |i: &i32| usize::try_from(*i).is_ok_and(|i| i < vertices);
    let consistent = offsets.len() == vertices + 1
        && offsets[0] == 0
        && offsets.is_sorted()
        && offsets[vertices] as usize == neighbours.len()
        && ties.len() == neighbours.len()
        && neighbours.iter().all(whole);
    if !consistent {
        return Err("the graph is inconsistent".into());
    }
    if parts <= 1 || vertices <= parts {
        return Ok((0..vertices as u32).map(|v| v.min(parts.max(1) as u32 - 1)).collect());
    }
    let (mut count, mut constraints) = (vertices as i32, 1_i32);
    let mut wanted = i32::try_from(parts).map_err(|_| "too many parts".to_owned())?;
    let (mut cut, mut part) = (0_i32, vec![0_i32; vertices]);
    let mut options = [0i32; metis_sys::METIS_NOPTIONS as usize];
    // SAFETY: `options` has METIS_NOPTIONS items; offsets, neighbours and ties form a consistent
    // graph; the other arrays have one item per vertex. Null stands for METIS' defaults. METIS
    // keeps no pointer.
    undisturbed(|| unsafe {
        metis_sys::METIS_SetDefaultOptions(options.as_mut_ptr());
        options[metis_sys::moptions_et_METIS_OPTION_SEED as usize] = SEED;
        metis_sys::METIS_PartGraphRecursive(
            &mut count,
            &mut constraints,
            offsets.as_mut_ptr(),
            neighbours.as_mut_ptr(),
            weights.as_mut_ptr(),
            std::ptr::null_mut(),
            ties.as_mut_ptr(),
            &mut wanted,
            std::ptr::null_mut(),
            std::ptr::null_mut(),
            options.as_mut_ptr(),
            &mut cut,
            part.as_mut_ptr(),
        )
    })
    .map_err(|status| format!("METIS' partition failed with status {status}"))?;
    Ok(part.into_iter().map(|part| part as u32).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ring of twelve vertices with two weak ties: the parts are the arcs between them.
    #[test]
    fn a_ring_is_cut_where_its_ties_are_weak() {
        let offsets = (0..=12).map(|v| 2 * v).collect();
        let neighbours = (0..12).flat_map(|v| [(v + 11) % 12, (v + 1) % 12]).collect();
        let tie = |v: i32| if v % 6 == 2 { 1 } else { 9 };
        let ties = (0..12).flat_map(|v| [tie((v + 11) % 12), tie(v)]).collect();
        let parts = partition_graph(offsets, neighbours, vec![1; 12], ties, 2).unwrap();
        assert!((3..9).all(|v| parts[v] == parts[3]) && (9..15).all(|v| parts[v % 12] == parts[9]), "{parts:?}");
        assert_ne!(parts[3], parts[9]);
    }

    /// A signal that METIS caught reaches the program's handler, and the call is repeated; METIS' own
    /// errors raise no signal.
    #[cfg(unix)]
    #[test]
    fn a_signal_to_terminate_is_passed_on() {
        use std::sync::atomic::{AtomicUsize, Ordering};
        static SIGNALS: AtomicUsize = AtomicUsize::new(0);
        extern "C" fn count(_: std::ffi::c_int) {
            SIGNALS.fetch_add(1, Ordering::Relaxed);
        }
        unsafe extern "C" {
            fn signal(signal: std::ffi::c_int, handler: extern "C" fn(std::ffi::c_int)) -> usize;
        }
        let mut statuses = [metis_sys::rstatus_et_METIS_ERROR, metis_sys::rstatus_et_METIS_OK].into_iter();
        let call = || {
            // Set here, where METIS does not run: as it ends, it sets the handlers that were there when it began.
            // SAFETY: the handler only increments a counter.
            unsafe { signal(TERMINATE, count) };
            statuses.next().unwrap()
        };
        assert_eq!(undisturbed(call), Ok(()));
        assert_eq!(SIGNALS.load(Ordering::Relaxed), 1);
        for own in [metis_sys::rstatus_et_METIS_ERROR, metis_sys::rstatus_et_METIS_ERROR_MEMORY] {
            assert_eq!(undisturbed(|| own), Err(own));
        }
        assert_eq!(SIGNALS.load(Ordering::Relaxed), 1);
    }

    #[test]
    fn graphs_that_contradict_themselves_are_refused() {
        let graph = |neighbours: Vec<i32>| partition_graph(vec![0, 1, 2, 2], neighbours, vec![1; 3], vec![1, 1], 2);
        assert!(graph(vec![1, 0]).is_ok());
        assert!(graph(vec![1]).is_err() && graph(vec![1, 3]).is_err() && graph(vec![1, -1]).is_err());
        assert_eq!(partition_graph(vec![0, 0, 0], vec![], vec![1; 2], vec![], 5), Ok(vec![0, 1]));
    }
}
