//! What a ledger is made of: rows that say what a source prints, what is right instead, and how that is measured.

/// One row. The wording is Markdown.
pub struct Row {
    pub id: &'static str,
    pub printed: &'static str,
    pub right: &'static str,
    pub effect: Effect,
}

/// What a row does to an image.
pub enum Effect {
    /// Images with `right` and with `right` + `printed` (both `key=value`, on top of the ledger's preset) are compared.
    Measured { right: &'static [&'static str], printed: &'static [&'static str] },
    /// As printed it does not compile or is undefined: there only the right form exists.
    NeverRan,
    /// Both forms gave the same image on every scene of the study: the switch is gone, a test of the formula stays.
    NoImage,
    /// There is no other form here.
    Fixed,
}
