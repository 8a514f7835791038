//! Nested dissection by METIS: Karypis and Kumar, SIAM J. Sci. Comput. 20 (1998).

use std::sync::Mutex;

/// Seed of METIS' random numbers.
const SEED: i32 = 20_011;

/// METIS draws from the random numbers of the C library, which all threads share: two orderings at
/// the same time would disturb each other and no longer be reproducible.
static ONE_ORDERING_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Vertices of a symmetric graph without loops in elimination order; `weights` are their numbers of unknowns.
pub(super) fn nested_dissection(
    mut offsets: Vec<i32>,
    mut neighbours: Vec<i32>,
    mut weights: Vec<i32>,
) -> Result<Vec<i32>, String> {
    let mut count = weights.len() as i32;
    let mut order = vec![0i32; weights.len()];
    let mut position = vec![0i32; weights.len()];
    let mut options = [0i32; metis_sys::METIS_NOPTIONS as usize];
    let guard = ONE_ORDERING_AT_A_TIME.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    // SAFETY: `options` has METIS_NOPTIONS items; offsets and neighbours form a valid symmetric
    // graph without loops; the other arrays have one item per vertex. METIS keeps no pointer.
    let status = unsafe {
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
    };
    drop(guard);
    if status == metis_sys::rstatus_et_METIS_OK {
        Ok(order)
    } else {
        Err(format!("METIS ordering failed with status {status}"))
    }
}
