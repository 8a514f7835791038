//! The contact status of a node, which the contact laws, the load path and the quantities of a design
//! share. Files and Python show it as [a number](ContactStatus::code).

/// Contact status of a slave node: the branch of the contact law on which it is.
///
/// Residuals, tangents and gradients are those of this branch; where the status changes, the solution
/// has a kink. Paper: the sets I, S_t and S_l of (31)–(34).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
#[repr(u8)]
pub enum ContactStatus {
    /// Open: no traction.
    #[default]
    Inactive = 0,
    /// In contact, tangential traction inside the friction cone; nodes of tied surfaces, too.
    Stick = 1,
    /// In contact, tangential traction on the friction cone; without friction, every node in contact.
    Slip = 2,
}

impl ContactStatus {
    /// All, in the order of their codes.
    pub const ALL: [Self; 3] = [Self::Inactive, Self::Stick, Self::Slip];

    /// The number in files and in Python: 0 open, 1 stick, 2 slip.
    pub fn code(self) -> u8 {
        self as u8
    }

    /// The status with this [code](Self::code).
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.get(usize::from(code)).copied()
    }

    /// Whether the node is in contact.
    pub fn is_closed(self) -> bool {
        self != Self::Inactive
    }

    /// Numbers of nodes that are open, stick and slip.
    pub fn counts(of: impl IntoIterator<Item = Self>) -> [usize; 3] {
        let mut counts = [0; 3];
        of.into_iter().for_each(|status| counts[usize::from(status.code())] += 1);
        counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The codes are part of the file formats: docs/results.md.
    #[test]
    fn codes_are_those_of_the_files() {
        assert_eq!(ContactStatus::ALL.map(ContactStatus::code), [0, 1, 2]);
        assert_eq!(ContactStatus::ALL, [ContactStatus::Inactive, ContactStatus::Stick, ContactStatus::Slip]);
        assert!(ContactStatus::ALL.iter().all(|&status| ContactStatus::from_code(status.code()) == Some(status)));
        assert_eq!(ContactStatus::from_code(3), None);
    }

    /// By counting.
    #[test]
    fn every_status_is_counted() {
        use ContactStatus::{Inactive, Slip, Stick};
        assert_eq!(ContactStatus::counts([Slip, Inactive, Slip, Stick, Slip]), [1, 1, 3]);
    }
}
