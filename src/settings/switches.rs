//! Switches for the rows of a ledger: each selects the form that its source prints, or the correct form.

use super::choices;

choices! {
    /// The form of a ledger's row: as its source prints it, or corrected.
    Form { Printed = "printed", Right = "right" }
}

/// Declares a `Ledger` of switches for rows: a table of settings, and the bit of each row.
macro_rules! switches {
    ($(#[$doc:meta])+ $table:literal, $cost:literal; $($row:ident $bit:literal $meaning:literal),+ $(,)?) => {
        $crate::settings::table! {
            $(#[$doc])+
            Ledger as $table {$(
                $row: $crate::settings::Form = $crate::settings::Form::Right, in "form" rare,
                    $crate::settings::names!($crate::settings::Form);
                $meaning;
                $cost;
            )+}
        }

        impl Ledger {
            /// All rows in one form.
            pub fn all(form: $crate::settings::Form) -> Self {
                Self { $($row: form),+ }
            }

            /// The rows in their printed form, one bit per number.
            pub fn printed_bits(&self) -> u32 {
                let rows = [$(($bit, self.$row)),+];
                rows.iter().filter(|(_, form)| *form == $crate::settings::Form::Printed).map(|(bit, _)| 1 << bit).sum()
            }
        }
    };
}
pub(crate) use switches;
