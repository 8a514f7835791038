//! The path that the next march follows for its start values, on disk.

use std::fs;
use std::io::Read;

use serde::{Deserialize, Serialize};
use slipstick_path::Guide;

use super::{RunDirectory, RunError, sha256};
use crate::output::write_atomically;

/// First bytes of a file, with the version of its layout.
const MAGIC: &[u8; 8] = b"slipsv01";

/// Files by turns, so that the one that a checkpoint names stays until the next checkpoint is written.
pub(super) const FILES: [&str; 2] = ["start_values_0.bin", "start_values_1.bin"];

/// A file of start values, as a checkpoint refers to it.
///
/// Little-endian: the magic bytes, number of states and of unknowns (u64), pseudo-times (f64), unknowns state by state
/// (f32). In single precision they do not lose what a start value needs, and a resumed run reads the same numbers.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StartValuesFile {
    file: String,
    sha256: String,
}

impl StartValuesFile {
    /// Writes the path that leads iteration `iteration`.
    ///
    /// # Errors
    /// [`RunError::Output`].
    pub fn write(run: &RunDirectory, iteration: usize, guide: &Guide) -> Result<Self, RunError> {
        let bytes = encode(guide);
        let file = FILES[iteration % 2];
        write_atomically(&run.file(file), |writer| writer.write_all(&bytes))?;
        Ok(Self { file: file.to_owned(), sha256: sha256(&bytes) })
    }

    /// Reads it back; `whole`, or only what all but the first of several ranks need: the times.
    ///
    /// # Errors
    /// [`RunError::Damaged`] where it is not the file that was written.
    pub fn read(&self, run: &RunDirectory, whole: bool) -> Result<Guide, RunError> {
        let damaged = |reason: &str| RunError::Damaged {
            path: run.file(&self.file),
            reason: reason.to_owned(),
            cure: "start anew with `slipstick optimize CASE --design RESULTS`".into(),
        };
        if !FILES.contains(&self.file.as_str()) {
            return Err(damaged("is no file of start values"));
        }
        let path = run.file(&self.file);
        if !path.exists() {
            return Err(damaged("is missing, which the checkpoint needs"));
        }
        if !whole {
            let file = fs::File::open(&path).map_err(RunError::read(&path))?;
            return decode_times(file).ok_or_else(|| damaged("holds no start values of this version"));
        }
        let bytes = fs::read(&path).map_err(RunError::read(&path))?;
        if sha256(&bytes) != self.sha256 {
            return Err(damaged("is not the file that the checkpoint names"));
        }
        decode(&bytes).ok_or_else(|| damaged("holds no start values of this version"))
    }
}

fn encode(guide: &Guide) -> Vec<u8> {
    let (times, unknowns) = (guide.times(), guide.unknowns());
    let length = unknowns.first().map_or(0, Vec::len);
    let mut bytes = Vec::with_capacity(24 + times.len() * (8 + 4 * length));
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&(times.len() as u64).to_le_bytes());
    bytes.extend_from_slice(&(length as u64).to_le_bytes());
    times.iter().for_each(|t| bytes.extend_from_slice(&t.to_le_bytes()));
    unknowns.iter().flatten().for_each(|u| bytes.extend_from_slice(&u.to_le_bytes()));
    bytes
}

fn decode(bytes: &[u8]) -> Option<Guide> {
    let rest = bytes.strip_prefix(MAGIC)?;
    let (states, rest) = rest.split_first_chunk::<8>()?;
    let (length, rest) = rest.split_first_chunk::<8>()?;
    let (states, length) = (usize::try_from(u64::from_le_bytes(*states)).ok()?, u64::from_le_bytes(*length));
    let length = usize::try_from(length).ok()?;
    let size = length.checked_mul(4)?.checked_add(8)?.checked_mul(states)?;
    if rest.len() != size || states == 0 || length == 0 {
        return None;
    }
    let (times, unknowns) = rest.split_at(8 * states);
    let times = times.as_chunks::<8>().0.iter().map(|t| f64::from_le_bytes(*t)).collect();
    let value = |u: &[u8; 4]| f32::from_le_bytes(*u);
    let unknowns =
        unknowns.chunks_exact(4 * length).map(|u| u.as_chunks::<4>().0.iter().map(value).collect()).collect();
    Guide::from_parts(times, unknowns).ok()
}

/// Pseudo-times alone, without reading what follows them.
fn decode_times(mut file: fs::File) -> Option<Guide> {
    let mut head = [0; 24];
    file.read_exact(&mut head).ok()?;
    let rest = head.strip_prefix(MAGIC)?;
    let states = usize::try_from(u64::from_le_bytes(*rest.first_chunk()?)).ok()?;
    // the file is as long as it says: no length from a damaged head is allocated
    let bytes = states.checked_mul(8).filter(|&bytes| file.metadata().is_ok_and(|m| m.len() >= bytes as u64))?;
    let mut times = vec![0; bytes];
    file.read_exact(&mut times).ok()?;
    let times = times.as_chunks::<8>().0.iter().map(|t| f64::from_le_bytes(*t)).collect();
    Guide::from_parts(times, vec![Vec::new(); states]).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn start_values_come_back_bit_for_bit_and_damage_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunDirectory::create(&folder.path().join("run"), false).unwrap();
        let guide = Guide::from_parts(vec![0.0, 0.3, 1.0], vec![vec![0.0; 2], vec![0.1, -2.5e-9], vec![1e30, 0.25]]);
        let guide = guide.unwrap();
        let file = StartValuesFile::write(&run, 3, &guide).unwrap();
        assert_eq!(file.read(&run, true).unwrap(), guide);
        let times = file.read(&run, false).unwrap();
        assert_eq!((times.times(), times.unknowns().concat()), (guide.times(), vec![]));
        let path = run.file(&file.file);
        let whole = fs::read(&path).unwrap();
        for bytes in [&whole[..whole.len() - 1], b"".as_slice()] {
            fs::write(&path, bytes).unwrap();
            assert!(matches!(file.read(&run, true), Err(RunError::Damaged { .. })));
            assert!(decode(bytes).is_none());
        }
        for at in 0..24 {
            let mut bytes = whole.clone();
            bytes[at] ^= 0x81;
            assert!(decode(&bytes).is_none(), "byte {at}");
        }
    }
}
