//! Checks of whole parts.
