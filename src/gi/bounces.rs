//! One pass per bounce, for methods that store a volume for each bounce and light list items.

use crate::Result;
use crate::ground::constants::{DIRECT_FOUND, DIRECT_KEPT, DIRECT_READ};
use crate::settings::Bounces;

/// Description of the pass that lights one bounce.
#[derive(Clone, Copy)]
pub struct BounceDesc {
    /// The bounce, 0 or 1.
    pub bounce: usize,
    /// Whether light of another bounce is looked up.
    pub gathers: bool,
    /// The treatment of direct light: a value of the constant `DIRECT`.
    pub direct: u32,
}

/// The passes that light one thing in each bounce.
pub struct PerBounce<P> {
    /// The first bounce without earlier light.
    pub first: P,
    /// The first bounce with the previous frame's light; `None` unless `bounces = all`.
    pub again: Option<P>,
    /// The second bounce, which gathers from the first; `None` with one bounce.
    pub second: Option<P>,
}

impl<P> PerBounce<P> {
    /// `keeps` says whether the first bounce keeps its direct light for the second one.
    ///
    /// # Errors
    /// Errors of `make`.
    pub fn new(bounces: Bounces, keeps: bool, make: impl Fn(BounceDesc) -> Result<P>) -> Result<Self> {
        let [first, second] = if keeps { [DIRECT_KEPT, DIRECT_READ] } else { [DIRECT_FOUND; 2] };
        let (again, two) = (bounces == Bounces::All, bounces.stored() > 1);
        Ok(Self {
            first: make(BounceDesc { bounce: 0, gathers: false, direct: first })?,
            again: again.then(|| make(BounceDesc { bounce: 0, gathers: true, direct: first })).transpose()?,
            second: two.then(|| make(BounceDesc { bounce: 1, gathers: true, direct: second })).transpose()?,
        })
    }

    /// Calls `light` for each bounce in order, with its pass, the volume to gather from and the one to fill. `volumes`
    /// has one per bounce; with `history`, the last one holds the light of the previous frame.
    pub fn each<V>(&self, volumes: &[V], history: bool, mut light: impl FnMut(&P, Option<&V>, &V)) {
        let [first, rest @ ..] = volumes else { return };
        // Everything is lit directly and, with all bounces, by the light of the previous frame.
        match (&self.again, rest) {
            (Some(again), [second]) if history => light(again, Some(second), first),
            _ => light(&self.first, None, first),
        }
        // Then everything is lit again, with light gathered from the first bounce.
        if let (Some(pass), [second]) = (&self.second, rest) {
            light(pass, Some(first), second);
        }
    }
}
