//! One pass per bounce, for methods that hold a volume for each and light list items.

use crate::Result;
use crate::ground::constants::{DIRECT_FOUND, DIRECT_KEPT, DIRECT_READ};
use crate::settings::Bounces;

/// Inputs of the pass that lights one bounce.
#[derive(Clone, Copy)]
pub struct BounceDesc {
    /// 0 or 1.
    pub bounce: usize,
    /// Whether there is light of another bounce to be looked up.
    pub gathers: bool,
    /// How the pass treats direct light: a value of the constant `DIRECT`.
    pub direct: u32,
}

/// The passes that light things, bounce by bounce.
pub struct PerBounce<P> {
    /// Nothing is gathered.
    pub first: P,
    /// The first bounce with the last frame's light to gather from; absent unless `bounces = all`.
    pub again: Option<P>,
    /// The second bounce, which gathers from the first; absent with one bounce.
    pub second: Option<P>,
}

impl<P> PerBounce<P> {
    /// `keeps`: the first bounce keeps its direct light for the second one.
    ///
    /// # Errors
    /// Those of `make`.
    pub fn new(bounces: Bounces, keeps: bool, make: impl Fn(BounceDesc) -> Result<P>) -> Result<Self> {
        let [first, second] = if keeps { [DIRECT_KEPT, DIRECT_READ] } else { [DIRECT_FOUND; 2] };
        let (again, two) = (bounces == Bounces::All, bounces.stored() > 1);
        Ok(Self {
            first: make(BounceDesc { bounce: 0, gathers: false, direct: first })?,
            again: again.then(|| make(BounceDesc { bounce: 0, gathers: true, direct: first })).transpose()?,
            second: two.then(|| make(BounceDesc { bounce: 1, gathers: true, direct: second })).transpose()?,
        })
    }

    /// Calls `light` for each bounce in its order, with its pass, the volume that is gathered from and the one that is
    /// filled. `volumes`: one per bounce; `history`: the last one holds the light of the frame before.
    pub fn each<V>(&self, volumes: &[V], history: bool, mut light: impl FnMut(&P, Option<&V>, &V)) {
        let [first, rest @ ..] = volumes else { return };
        // Everything is lit directly and, with all bounces, by what the last frame left, or directly alone;
        match (&self.again, rest) {
            (Some(again), [second]) if history => light(again, Some(second), first),
            _ => light(&self.first, None, first),
        }
        // then once more, with what it gathers from the first bounce.
        if let (Some(pass), [second]) = (&self.second, rest) {
            light(pass, Some(first), second);
        }
    }
}
