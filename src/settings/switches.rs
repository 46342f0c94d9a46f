//! Settings that switch the rows of a ledger: each as its source prints it, or as it should be.

use super::choices;

choices! {
    /// One row of a ledger: as its source prints it, or as it should be.
    Form { Printed = "printed", Right = "right" }
}

/// Declares a `Ledger` of settings, the rows that are switched one by one: fields, keys and bits of one list.
macro_rules! switches {
    ($(#[$doc:meta])+ $cost:literal; $($row:ident $bit:literal $name:literal $meaning:literal),+ $(,)?) => {
        $(#[$doc])+
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct Ledger { $(#[doc = $meaning] pub $row: $crate::settings::Form),+ }

        impl Ledger {
            /// Every row in one form.
            pub fn all(form: $crate::settings::Form) -> Self {
                Self { $($row: form),+ }
            }

            /// The rows that are as printed, one bit per number.
            pub fn printed_bits(&self) -> u32 {
                let rows = [$(($bit, self.$row)),+];
                rows.iter().filter(|(_, form)| *form == $crate::settings::Form::Printed).map(|(bit, _)| 1 << bit).sum()
            }
        }

        impl Default for Ledger {
            fn default() -> Self {
                Self::all($crate::settings::Form::Right)
            }
        }

        const LEDGER_KEYS: &[$crate::settings::Key] = &[$($crate::settings::rare($crate::settings::key(
            $name,
            "form",
            $crate::settings::Range::Choice(|| $crate::settings::Form::ALL.iter().map(|form| form.name()).collect()),
            $meaning,
            $cost,
        ))),+];
    };
}
pub(crate) use switches;
