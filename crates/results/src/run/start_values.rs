//! The path that the next march follows for its start values, on disk.

use std::fs;
use std::io::{self, Read, Seek, SeekFrom};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use slipstick_linalg::{Ranks, own_range};
use slipstick_path::Guide;

use super::first::agree;
use super::{RunDirectory, RunError};
use crate::output::write_atomically;
use slipstick_case::file::hexadecimal;

/// First bytes of a file, with the version of its layout.
const MAGIC: &[u8; 8] = b"slipsv01";

/// The files are used alternately, so that the one that a checkpoint names remains until the next
/// checkpoint is written.
pub(super) const FILES: [&str; 6] = [
    "start_values_0.bin",
    "start_values_1.bin",
    "start_values_eroded_0.bin",
    "start_values_eroded_1.bin",
    "start_values_dilated_0.bin",
    "start_values_dilated_1.bin",
];

/// A file of start values, as a checkpoint refers to it.
///
/// Little-endian: the magic bytes, number of states and of unknowns (u64), pseudo-times (f64),
/// unknowns state by state (f32). Single precision is accurate enough for start values, and a
/// resumed run reads the same numbers.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StartValuesFile {
    file: String,
    sha256: String,
}

impl StartValuesFile {
    /// Writes the path that iteration `iteration` follows with a realization of the design: 0 for
    /// the nominal one, 1 for the eroded and 2 for the dilated one. All ranks call it; `run` is that of the
    /// first rank, if it keeps one.
    ///
    /// # Errors
    /// [`RunError::Output`] on the first rank, [`RunError::FirstRank`] on the others.
    pub fn write(
        run: Option<&RunDirectory>,
        (iteration, realisation): (usize, usize),
        guide: &Guide,
        ranks: &dyn Ranks,
    ) -> Result<Option<Self>, RunError> {
        let file = FILES[2 * realisation + iteration % 2];
        let written = guide.with_unknowns(ranks, |unknowns| {
            let Some(run) = run else { return Ok(None) };
            let mut hash = Sha256::new();
            write_atomically(&run.file(file), |writer| {
                let mut put = |bytes: &[u8]| {
                    hash.update(bytes);
                    writer.write_all(bytes)
                };
                put(&head(guide))?;
                (0..guide.times().len()).try_for_each(|state| {
                    put(&unknowns(state).iter().flat_map(|u| u.to_le_bytes()).collect::<Vec<u8>>())
                })
            })?;
            Ok(Some(Self { file: file.to_owned(), sha256: hexadecimal(&hash.finalize()) }))
        });
        Ok(agree(ranks, written)?.flatten())
    }

    /// Reads the file back; each rank reads its part, and the first rank compares the hash.
    ///
    /// # Errors
    /// [`RunError::Damaged`] if it is not the file that was written.
    pub fn read(&self, run: &RunDirectory, ranks: &dyn Ranks) -> Result<Guide, RunError> {
        let damaged = |reason: &str| RunError::Damaged {
            path: run.file(&self.file),
            reason: reason.to_owned(),
            cure: "start a new run with `slipstick optimize CASE --design RESULTS`".into(),
        };
        if !FILES.contains(&self.file.as_str()) {
            return Err(damaged("is not a file of start values"));
        }
        let path = run.file(&self.file);
        if !path.exists() {
            return Err(damaged("is missing, but the checkpoint needs it"));
        }
        let open = || fs::File::open(&path).map_err(RunError::read(&path));
        if ranks.rank() == 0 && hash_of(open()?).map_err(RunError::read(&path))? != self.sha256 {
            return Err(damaged("is not the file that the checkpoint names"));
        }
        decode(open()?, ranks).ok_or_else(|| damaged("contains no start values of this version"))
    }
}

/// SHA-256 of a file of any length, in hexadecimal; it is read piece by piece.
fn hash_of(mut file: fs::File) -> io::Result<String> {
    let (mut hash, mut piece) = (Sha256::new(), vec![0; 1 << 16]);
    loop {
        match file.read(&mut piece)? {
            0 => return Ok(hexadecimal(&hash.finalize())),
            count => hash.update(&piece[..count]),
        }
    }
}

/// The header, which precedes the unknowns.
fn head(guide: &Guide) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend_from_slice(&(guide.times().len() as u64).to_le_bytes());
    bytes.extend_from_slice(&(guide.length() as u64).to_le_bytes());
    guide.times().iter().for_each(|t| bytes.extend_from_slice(&t.to_le_bytes()));
    bytes
}

/// The times, and this rank's part of the unknowns.
fn decode(mut file: fs::File, ranks: &dyn Ranks) -> Option<Guide> {
    let mut start = [0; 24];
    file.read_exact(&mut start).ok()?;
    let rest = start.strip_prefix(MAGIC)?;
    let (states, rest) = rest.split_first_chunk::<8>()?;
    let (length, _) = rest.split_first_chunk::<8>()?;
    let states = usize::try_from(u64::from_le_bytes(*states)).ok()?;
    let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
    // the file must have the length that it states, so that a length from a damaged header is never
    // allocated
    let size = length.checked_mul(4)?.checked_add(8)?.checked_mul(states)?.checked_add(start.len())?;
    if states == 0 || length == 0 || file.metadata().ok()?.len() != size as u64 {
        return None;
    }
    let mut times = vec![0; 8 * states];
    file.read_exact(&mut times).ok()?;
    let times = times.as_chunks::<8>().0.iter().map(|t| f64::from_le_bytes(*t)).collect();
    let own = own_range(length, ranks);
    let mut part = vec![0; 4 * own.len()];
    let mut unknowns = Vec::with_capacity(states);
    for state in 0..states {
        let at = start.len() + 8 * states + 4 * (state * length + own.start);
        file.seek(SeekFrom::Start(at as u64)).ok()?;
        file.read_exact(&mut part).ok()?;
        unknowns.push(part.as_chunks::<4>().0.iter().map(|u| f32::from_le_bytes(*u)).collect());
    }
    Guide::from_parts(times, unknowns, length, ranks).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_linalg::Alone;

    #[test]
    fn start_values_come_back_bit_for_bit_and_damage_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunDirectory::create(&folder.path().join("run"), false).unwrap();
        let states = vec![vec![0.0; 2], vec![0.1, -2.5e-9], vec![1e30, 0.25]];
        let guide = Guide::from_parts(vec![0.0, 0.3, 1.0], states, 2, &Alone).unwrap();
        let file = StartValuesFile::write(Some(&run), (3, 0), &guide, &Alone).unwrap().unwrap();
        assert_eq!(file.read(&run, &Alone).unwrap(), guide);
        let path = run.file(&file.file);
        let whole = fs::read(&path).unwrap();
        let read = || decode(fs::File::open(&path).unwrap(), &Alone);
        for bytes in [&whole[..whole.len() - 1], b"".as_slice()] {
            fs::write(&path, bytes).unwrap();
            assert!(matches!(file.read(&run, &Alone), Err(RunError::Damaged { .. })));
            assert!(read().is_none());
        }
        for at in 0..24 {
            let mut bytes = whole.clone();
            bytes[at] ^= 0x81;
            fs::write(&path, bytes).unwrap();
            assert!(read().is_none(), "byte {at}");
        }
    }
}
