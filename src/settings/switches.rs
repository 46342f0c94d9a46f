//! Settings that switch the rows of a ledger: each as its source prints it, or as it should be.

use super::choices;

choices! {
    /// One row of a ledger: as its source prints it, or as it should be.
    Form { Printed = "printed", Right = "right" }
}

/// Declares a `Ledger` of settings, the rows that are switched one by one: a table, and the bit of each row.
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
    };
}
pub(crate) use switches;
