//! The edges of the program's code that an input reaches, where the build counts them (`docs/notes/fuzzing.md` says
//! how). Otherwise nothing is counted, and inputs are new by their outcome alone.

use std::sync::Mutex;

/// The counters of every part of the program: address and length.
static PARTS: Mutex<Vec<(usize, usize)>> = Mutex::new(Vec::new());

/// Called by instrumented code before `main`, once for every part.
#[unsafe(no_mangle)]
extern "C" fn __sanitizer_cov_8bit_counters_init(start: *mut u8, stop: *mut u8) {
    let (start, stop) = (start as usize, stop as usize);
    if let Ok(mut parts) = PARTS.lock()
        && !parts.contains(&(start, stop - start))
    {
        parts.push((start, stop - start));
    }
}

/// The counts that inputs have reached.
#[derive(Default)]
pub struct Coverage {
    /// For each counter a bit for each range of counts.
    seen: Vec<u8>,
}

impl Coverage {
    /// Resets the counters before an input.
    pub fn clear(&mut self) {
        counters().for_each(|part| part.fill(0));
    }

    /// After an input: whether a counter reached a range of counts for the first time.
    pub fn is_new(&mut self) -> bool {
        let (mut at, mut new) = (0, false);
        for part in counters() {
            self.seen.resize(self.seen.len().max(at + part.len()), 0);
            let (words, _) = part.as_chunks::<8>();
            for (i, word) in words.iter().enumerate().filter(|(_, word)| **word != [0; 8]) {
                for (counter, seen) in word.iter().zip(&mut self.seen[at + 8 * i..]).filter(|(c, _)| **c > 0) {
                    // 1, 2 to 3, 4 to 7, …
                    let range = 1 << counter.ilog2();
                    new |= *seen & range == 0;
                    *seen |= range;
                }
            }
            at += part.len();
        }
        new
    }
}

fn counters() -> impl Iterator<Item = &'static mut [u8]> {
    let parts = PARTS.lock().map(|parts| parts.clone()).unwrap_or_default();
    // SAFETY: the linker made these arrays of bytes, which live as long as the program. Instrumented code writes single
    // bytes meanwhile, on this thread or another; a lost count does no harm.
    parts.into_iter().map(|(start, length)| unsafe { std::slice::from_raw_parts_mut(start as *mut u8, length) })
}
